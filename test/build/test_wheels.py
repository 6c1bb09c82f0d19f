# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool that builds wheels for boards: what it would build, and headers.

Building takes minutes a wheel: `make wheels` does that, and tries each.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import zipfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts" / "wheels"))
import building  # noqa: E402
import making  # noqa: E402
import packing  # noqa: E402
import pythons  # noqa: E402
import sources  # noqa: E402
import symbols  # noqa: E402
import targets  # noqa: E402


def test_all_there_is():
    names = [target.name for target in targets.list_targets()]
    assert len(names) == 9 and len(set(names)) == 9
    assert {"cp311-armv7l", "cp312-x86_64", "cp313-aarch64"} <= set(names)


def test_patterns():
    names = [t.name for t in targets.list_targets(["cp311-*", "cp313-armv7l"])]
    assert names == ["cp311-x86_64", "cp311-aarch64", "cp311-armv7l", "cp313-armv7l"]


def test_unknown_pattern_is_an_error_with_the_names():
    result = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "wheels"), "cp39-mips"], text=True,
        capture_output=True)
    assert result.returncode == 2
    assert "'cp39-mips'" in result.stderr and "cp311-aarch64" in result.stderr


def test_names_of_modules_are_those_python_looks_for():
    import importlib.machinery
    python = "%d%d" % sys.version_info[:2]
    target = targets.Target(python, targets.ARCHES["x86_64"])
    import platform
    if platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc":
        assert target.suffix in importlib.machinery.EXTENSION_SUFFIXES


@pytest.fixture
def headers(tmp_path, monkeypatch):
    """(pyconfig.h of 64 bits, target of 32 bits whose other Python is there)."""
    target = targets.Target("312", targets.ARCHES["armv7l"])
    folder = tmp_path / "usr/include/arm-linux-gnueabihf/python3.11"
    folder.mkdir(parents=True)
    (folder / "pyconfig.h").write_text(
        "#define SIZEOF_LONG 4\n#define SIZEOF_VOID_P 4\n")
    monkeypatch.setattr(pythons, "unpack_debian", lambda target: tmp_path)
    config = tmp_path / "pyconfig.h"
    config.write_text("#define HAVE_GCC_ASM_FOR_X64 1\n#define SIZEOF_LONG 8\n"
                      "#define SIZEOF_INT 4\n#define SIZEOF_VOID_P 8\n")
    return config, target


def test_sizes_of_another_architecture(headers):
    config, target = headers
    pythons.take_sizes(config, target)
    text = config.read_text()
    assert "#define SIZEOF_LONG 4\n" in text and "#define SIZEOF_VOID_P 4\n" in text
    assert "#define SIZEOF_INT 4\n" in text
    assert "#define HAVE_GCC_ASM_FOR_X64" not in text


def test_compiler_refuses_wrong_sizes(headers):
    """Of this machine, by its own compiler."""
    config, target = headers
    if sys.maxsize < 2 ** 32 or not shutil.which("cc"):
        pytest.skip("needs a compiler for 64 bits")
    pythons.check_sizes(config.parent, "cc")
    pythons.take_sizes(config, target)
    with pytest.raises(pythons.Missing, match="SIZEOF_LONG"):
        pythons.check_sizes(config.parent, "cc")


def make_zip(path, names, date):
    with zipfile.ZipFile(path, "w") as file:
        for name in names:
            info = zipfile.ZipInfo(name, date)
            info.external_attr = (0o755 if name.endswith(".so") else 0o600) << 16
            file.writestr(info, "text of " + name)


def test_same_files_are_the_same_bytes(tmp_path):
    names = ["a-1.dist-info/RECORD", "a/x.so", "a/b.py"]
    make_zip(tmp_path / "1.whl", names, (2020, 1, 1, 0, 0, 0))
    make_zip(tmp_path / "2.whl", names[::-1], (2021, 2, 2, 2, 2, 2))
    for number in "12":
        packing.normalize(tmp_path / (number + ".whl"), 10 ** 9, tmp_path / number)
    assert (tmp_path / "1").read_bytes() == (tmp_path / "2").read_bytes()
    infos = zipfile.ZipFile(tmp_path / "1").infolist()
    assert [info.filename for info in infos] == ["a/b.py", "a/x.so", names[0]]
    assert [info.external_attr >> 16 for info in infos] == [
        0o100644, 0o100755, 0o100644]
    assert {info.date_time for info in infos} == {(2001, 9, 9, 1, 46, 40)}


@pytest.fixture
def tree(tmp_path):
    """A small folder of sources."""
    for name in ("klippy/a.py", "scripts/build_commands.py", "scripts/other.py",
                 "VERSION"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    return tmp_path


def test_sum_changes_with_what_is_in_the_wheel_alone(tree):
    first = sources.calc_sum("setting", root=tree)
    (tree / "klippy/a.cpython-311.so").write_text("built")
    (tree / "klippy/__pycache__").mkdir()
    (tree / "klippy/__pycache__/a.py").write_text("built")
    (tree / "scripts/other.py").write_text("changed")
    assert sources.calc_sum("setting", root=tree) == first
    assert sources.calc_sum("other setting", root=tree) != first
    (tree / "scripts/build_commands.py").write_text("changed")
    second = sources.calc_sum("setting", root=tree)
    (tree / "klippy/a.py").rename(tree / "klippy/b.py")
    assert len({first, second, sources.calc_sum("setting", root=tree)}) == 3


def test_steps_are_done_once(tmp_path):
    notes = making.Notes(tmp_path / "notes.json")
    notes.put("build", "sum 1", ["name", "sum 2"])
    again = making.Notes(tmp_path / "notes.json")
    assert again.find("build", "sum 1") == ["name", "sum 2"]
    assert again.find("build", "sum 3") is None and again.find("smoke", "x") is None
    (tmp_path / "notes.json").write_text("{half of")
    assert making.Notes(tmp_path / "notes.json").find("build", "sum 1") is None


def test_told_version_and_time_win(monkeypatch):
    monkeypatch.setenv("KLIPPY_FIRMWARE_VERSION", "v9.9-told")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "123")
    assert sources.read_version() == "v9.9-told" and sources.read_time() == "123"
    sys.path.insert(0, str(ROOT / "scripts"))
    import build_commands
    assert build_commands.read_version(ROOT) == "v9.9-told"


def test_missing_names_of_python_are_found(tmp_path):
    pytest.importorskip("elftools", reason="pyelftools is with auditwheel")
    if not shutil.which("cc"):
        pytest.skip("needs a compiler")
    target = targets.Target("%d%d" % sys.version_info[:2], targets.ARCHES["x86_64"])
    try:
        pythons.find_local(target.version)
    except pythons.Missing as err:
        pytest.skip(str(err))

    def build(call):
        code = "void %s(void); void use(void) { %s(); }" % (call, call)
        subprocess.run(["cc", "-shared", "-fPIC", "-xc", "-", "-o",
                        str(tmp_path / ("module" + target.suffix))],
                       input=code, text=True, check=True)
        return symbols.check_symbols(tmp_path, target)

    assert "all 1 names" in build("PyErr_Occurred")
    with pytest.raises(building.BuildError, match="PyNo_Such"):
        build("PyNo_Such")


def test_compiler_writes_no_path_of_the_build(tmp_path):
    pytest.importorskip("ziglang")
    target = targets.Target("311", targets.ARCHES["aarch64"])
    made = []
    for name in ("one", "two"):
        folder = tmp_path / name
        compiler = building.make_compiler(target, folder)
        (folder / "a.c").write_text("const char *where(void) { return __FILE__; }")
        subprocess.run([compiler, "-O2", "-c", str(folder / "a.c"), "-o",
                        str(folder / "a.o")], check=True, cwd=folder,
                       env=dict(os.environ, ZIG_GLOBAL_CACHE_DIR=str(folder / "c")))
        made.append((folder / "a.o").read_bytes())
    assert made[0] == made[1] and str(tmp_path).encode() not in made[0]


@pytest.mark.parametrize("arch", ["armv7l", "aarch64"])
def test_module_holds_what_it_uses(tmp_path, arch):
    """Modules are linked without -O: the compiler's library stays outside."""
    pytest.importorskip("ziglang")
    target = targets.Target("311", targets.ARCHES[arch])
    compiler = building.make_compiler(target, tmp_path)
    (tmp_path / "a.c").write_text("int add(int a, int b) { return a / b; }")
    for args in (["-O2", "-g1", "-fPIC", "-c", "a.c", "-o", "a.o"],
                 ["-shared", "a.o", "-o", "a.so"]):
        subprocess.run([compiler, *args], check=True, cwd=tmp_path)
    assert (tmp_path / "a.so").stat().st_size < 16000


def test_loader_is_where_programs_look(tmp_path):
    merged, split = tmp_path / "merged", tmp_path / "split"
    (merged / "usr/lib").mkdir(parents=True)
    (merged / "usr/lib/ld.so").write_text("loader")
    (split / "lib").mkdir(parents=True)
    for root in (merged, split, merged):
        pythons.link_libraries(root)
    assert (merged / "lib/ld.so").read_text() == "loader"
    assert not (split / "lib").is_symlink()
