# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs of both PRUs go where Linux loads them from, and the cores start."""

import pytest

from klippy.errors import PrinterError
from klippy.flash import methods
from klippy.flash.target import Target


class Core:
    """A core as Linux shows it: one that runs does not take another program."""

    def __init__(self, folder, name, state):
        self.folder = folder
        folder.mkdir(parents=True)
        for file, text in (("name", name), ("state", state), ("firmware", "old")):
            (folder / file).write_text(text + "\n")

    def read(self, file):
        return (self.folder / file).read_text().strip()


@pytest.fixture
def target(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    for core in "01":
        (out / ("pru%s.elf" % (core,))).write_text("program " + core)
    return Target(out, {"BOARD_DIRECTORY": "pru", "MCU": "pru"})


@pytest.fixture
def root(tmp_path):
    (tmp_path / "root/lib/firmware").mkdir(parents=True)
    return tmp_path / "root"


def make_cores(root):
    """The chip has other cores, too, and numbers follow no order."""
    place = root / "sys/class/remoteproc"
    return [Core(place / ("remoteproc%d" % (i,)), name, state)
            for i, name, state in ((0, "wkup_m3", "running"),
                                   (2, "4a334000.pru", "running"),
                                   (1, "4a338000.pru", "offline"))]


def test_both_cores_get_their_programs(root, target):
    other, *cores = make_cores(root)
    methods.flash(target, root=root)
    for i, core in enumerate(cores):
        name = "am335x-pru%d-fw" % (i,)
        assert (root / "lib/firmware" / name).read_text() == "program %d" % (i,)
        assert core.read("firmware") == name and core.read("state") == "start"
    assert other.read("state") == "running" and other.read("firmware") == "old"


def test_elsewhere_there_are_no_cores(root, target):
    with pytest.raises(PrinterError, match="4a334000.pru"):
        methods.flash(target, root=root)


def test_missing_program(root, target):
    cores = make_cores(root)
    (target.folder / "pru1.elf").unlink()
    with pytest.raises(PrinterError, match="pru1.elf"):
        methods.flash(target, root=root)
    assert [core.read("state") for core in cores] == ["running", "running", "offline"]


def test_no_right_to_write(root, target):
    cores = make_cores(root)
    (root / "lib/firmware/am335x-pru0-fw").mkdir()
    with pytest.raises(PrinterError, match="sudo"):
        methods.flash(target, root=root)
    assert cores[2].read("firmware") == "old"
