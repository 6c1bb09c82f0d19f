# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheel, installed into an environment of its own, works without the tree."""

import os
import pathlib
import subprocess
import sys
import sysconfig
import venv
import zipfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONFIG = ROOT / "config" / "sample-corexy.cfg"


def run(*args, folder):
    """Run a command in a folder, with nothing of ours in its environment."""
    environ = {name: value for name, value in os.environ.items()
               if not name.startswith(("PYTHON", "KLIPPY"))}
    result = subprocess.run(
        [str(arg) for arg in args], cwd=folder, env=environ, text=True,
        stdin=subprocess.DEVNULL, capture_output=True, timeout=600)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    pytest.importorskip("Cython")
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation",
        "--quiet", "--wheel-dir", folder, ROOT, folder=ROOT)
    return next(folder.glob("klippy_host-*.whl"))


@pytest.fixture(scope="module")
def klippy(wheel, tmp_path_factory):
    """Path of the command of an environment with the wheel.

    The packages that it depends on are those that run this test.
    """
    folder = tmp_path_factory.mktemp("venv")
    venv.create(folder, with_pip=False)
    site = next(folder.glob("lib/python*/site-packages"))
    run(sys.executable, "-m", "pip", "install", "--no-deps", "--quiet",
        "--target", site, wheel, folder=folder)
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    command = folder / "bin" / "klippy"
    script = site / "bin" / "klippy"
    lines = script.read_text().splitlines(keepends=True)
    command.write_text("#!%s\n" % (folder / "bin" / "python",) + "".join(lines[1:]))
    command.chmod(0o755)
    return command


def test_what_is_inside(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert any(name.endswith("libklippyc.so") for name in names)
    assert any("klippy/simulator/firmware/" in name and name.endswith(".so")
               for name in names)
    assert any(name.startswith("klippy/toolhead.") and name.endswith(".so")
               for name in names)
    assert any(name.endswith("cube20.gcode") for name in names)
    assert not [name for name in names if name.startswith(("test/", "src/"))]


def test_it_is_the_installed_one(klippy, tmp_path):
    python = klippy.parent / "python"
    where = run(python, "-c", "import klippy, klippy.toolhead as t;"
                "print(klippy.__file__, t.__file__)", folder=tmp_path).split()
    assert all(path.startswith(str(klippy.parents[1])) for path in where)
    assert where[1].endswith(".so")


def test_version(klippy, tmp_path):
    version = (ROOT / "VERSION").read_text().strip()
    assert version in run(klippy, "--version", folder=tmp_path)


def test_check(klippy, tmp_path):
    run(klippy, "check", CONFIG, folder=tmp_path)


def test_demo_prints(klippy, tmp_path):
    output = run(klippy, "demo", folder=tmp_path)
    assert "Done." in output and "Late mcu events     0" in output
