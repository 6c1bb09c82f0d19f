# SPDX-License-Identifier: GPL-3.0-or-later
"""What is told about the machine and the software."""

import os
import re

from klippy import sysinfo


def test_version_has_the_shape_of_git_describe(monkeypatch):
    assert re.match(r"v?\d+\.\d+", sysinfo.get_version())
    assert sysinfo._shape("v1.2-3-gabc") == "v1.2-3-gabc"
    monkeypatch.setattr(sysinfo, "read_package_version", lambda: "0.1.0")
    assert sysinfo._shape("abc1234-dirty") == "v0.1.0-0-gabc1234-dirty"


def test_version_without_git(monkeypatch, tmp_path):
    monkeypatch.setattr(sysinfo, "ROOT", tmp_path)
    (tmp_path / "VERSION").write_text("1.2.3\n")
    assert sysinfo.get_version() == "1.2.3"


def test_cpu_info():
    assert re.match(r"\d+ core ", sysinfo.get_cpu_info())


def test_stale_modules_are_found(tmp_path, monkeypatch):
    monkeypatch.delenv("KLIPPY_PURE", raising=False)
    for name in ("old", "new", "alone"):
        (tmp_path / (name + ".cpython-311-x86_64-linux-gnu.so")).write_text("")
    for name in ("old", "new"):
        (tmp_path / (name + ".py")).write_text("")
    os.utime(tmp_path / "new.py", (1., 1.))
    os.utime(tmp_path / "old.cpython-311-x86_64-linux-gnu.so", (1., 1.))
    assert sysinfo.find_stale_modules(tmp_path) == [str(tmp_path / "old.py")]
    monkeypatch.setenv("KLIPPY_PURE", "1")
    assert sysinfo.find_stale_modules(tmp_path) == []


def test_installed_package_has_no_stale_modules(tmp_path, monkeypatch):
    """Its files have the times of unpacking, in any order."""
    (tmp_path / "klippy").mkdir()
    (tmp_path / "klippy/a.so").write_text("")
    (tmp_path / "klippy/a.py").write_text("")
    os.utime(tmp_path / "klippy/a.so", (1, 1))
    monkeypatch.delenv("KLIPPY_PURE", raising=False)
    monkeypatch.setattr(sysinfo, "ROOT", tmp_path)
    assert sysinfo.find_stale_modules() == []
    (tmp_path / "setup.py").write_text("")
    assert sysinfo.find_stale_modules() == [str(tmp_path / "klippy/a.py")]
