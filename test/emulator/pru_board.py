# SPDX-License-Identifier: GPL-3.0-or-later
"""Both PRUs of an AM335x with our firmware, and Linux's side of their link."""

import pathlib
import subprocess
import sys

import firmware_matrix

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "test" / "emulator"
sys.path.append(str(ROOT / "test" / "firmware"))
from simboard import SimBoard  # noqa: E402

SETTLE_TIME = 0.002     # s, for a command and its answers


def why_not():
    """What is missing for these tests, or an empty text."""
    if firmware_matrix.find_prefix("pru") is None:
        return firmware_matrix.say_missing("pru")
    return ""


def build_adapter(folder):
    """Path of the shared object with the models of the chip."""
    path = folder / "pru_vmcu.so"
    subprocess.run(
        ["cc", "-std=gnu11", "-O3", "-flto", "-shared", "-fPIC", "-Wall", "-Wextra",
         "-Wshadow", "-Werror", "-I", str(ROOT / "klippy_ext" / "csrc"),
         *[str(FOLDER / ("pru_%s.c" % (part,)))
           for part in ("core", "soc", "arm", "vmcu")], "-o", str(path)], check=True)
    return path


def choose_chip(monkeypatch, out):
    """What the adapter starts when power comes on; out: a built firmware."""
    for core in ("0", "1"):
        monkeypatch.setenv("PRU%s_ELF" % (core,), str(out / ("pru%s.elf" % (core,))))


class PruBoard(SimBoard):
    """A message of rpmsg holds whole blocks, of which there may be several."""

    def send_raw(self, data):
        super().send_raw(data)
        self.run_for(SETTLE_TIME)

    def find_pin(self, name):
        """Number of a pin by its name."""
        number = self.ops.find_pin(name.encode())
        assert number >= 0, name
        return number
