# SPDX-License-Identifier: GPL-3.0-or-later
"""scripts/system_packages.sh as somebody who may not install anything."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = (ROOT / "scripts" / "system_packages.sh").read_text()
NOBODY = 65534
PROGRAMS = {"gcc": "cc", "make": "make", "git": "git"}


@pytest.fixture
def programs(tmp_path_factory):
    """A folder with the programs of a run, for any user: links to real ones."""
    folder = tmp_path_factory.mktemp("bin")
    for parent in (folder, *folder.parents):
        if parent == pathlib.Path(tempfile.gettempdir()):
            break
        parent.chmod(0o755)
    for name in (*PROGRAMS.values(), "sh", "id", "ls", "test", "echo"):
        (folder / name).symlink_to(shutil.which(name))
    # has the modules and headers that count
    (folder / "python3").write_text("#!%s/sh\nexit 0\n" % (folder,))
    (folder / "python3").chmod(0o755)
    return folder


def run(folder, what="run"):
    """The finished script; only the programs of a folder are there."""
    other = {"user": NOBODY} if os.getuid() == 0 else {}
    return subprocess.run(
        [str(folder / "sh"), "-s", what], input=SCRIPT, text=True, cwd="/",
        capture_output=True, env={"PATH": str(folder)}, **other)


def test_all_there(programs):
    result = run(programs)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


@pytest.mark.parametrize("packages", [["gcc"], ["git"], ["gcc", "make", "git"]])
def test_missing_programs(programs, packages):
    for package in packages:
        (programs / PROGRAMS[package]).unlink()
    result = run(programs)
    assert result.returncode == 1 and result.stderr == ""
    assert result.stdout.splitlines()[1].split() == [
        "sudo", "apt-get", "install", "-y", "--no-install-recommends", *packages]


def test_python_without_venv_and_headers(programs):
    (programs / "python3").write_text("#!%s/sh\nexit 1\n" % (programs,))
    result = run(programs)
    assert result.returncode == 1
    assert result.stdout.splitlines()[1].endswith(" python3-venv python3-dev ")


def test_this_python(programs):
    """What runs these tests has what a run needs."""
    if not pathlib.Path(sys.executable).resolve().is_relative_to("/usr"):
        pytest.skip("another user may not be allowed to run this Python")
    (programs / "python3").unlink()
    (programs / "python3").symlink_to(sys.executable)
    assert run(programs).returncode == 0


def test_tests_need_more(programs):
    result = run(programs, "test")
    assert result.returncode == 1
    assert {"gcc-avr", "valgrind", "clang"} <= set(
        result.stdout.splitlines()[1].split())


def test_bad_use(programs):
    result = run(programs, "all")
    assert result.returncode == 2 and "usage" in result.stderr
