# SPDX-License-Identifier: GPL-3.0-or-later
"""The linux firmware behind a link of the virtual machine's kernel."""

import os
import pathlib
import select
import subprocess
import sys
import threading
import tty

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "test"), str(ROOT / "test" / "firmware"),
                str(ROOT / "test" / "unit" / "flash")]
FOLDER = pathlib.Path("/mnt")
# Motors count these; an emulated computer is late by far
OPTIONS = ("--max-late", "10000")


def ok(name):
    """Tell the test that a check has passed."""
    print("ok " + name, flush=True)


def run(*words):
    """A program's output; it must succeed."""
    result = subprocess.run([str(w) for w in words], capture_output=True, text=True,
                            check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def open_terminal(path):
    """A terminal's descriptor, raw."""
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(fd)
    return fd


class Relay(threading.Thread):
    """Carries bytes between the firmware's terminal and another descriptor."""

    def __init__(self, console, other):
        super().__init__(daemon=True)
        self.console, self.other = open_terminal(console), other
        self.count = {self.console: 0, other: 0}        # bytes that came from it

    def run(self):
        while True:
            for fd in select.select([self.console, self.other], [], [])[0]:
                if fd == self.console:
                    data = os.read(fd, 4096)
                    self.to_host(data)
                else:
                    data = self.from_host()
                    os.write(self.console, data)
                self.count[fd] += len(data)

    def to_host(self, data):
        os.write(self.other, data)

    def from_host(self):
        return os.read(self.other, 4096)


def check_print(machine):
    """Home, move, and see where the motors are."""
    printer = machine.printer
    printer.wait_state("ready")
    ok("ready")
    printer.gcode("G28")
    origin = machine.positions()
    at = printer.status("toolhead")["position"][:3]
    printer.gcode("G90\nG1 X40 Y10 F6000\nG1 X40 Y40 Z3\nG1 X20 Y30 Z2\nM400")
    moved = [p - o for p, o in zip(machine.positions(), origin, strict=True)]
    wanted = [p - o for p, o in zip((20., 30., 2.), at, strict=True)]
    assert all(abs(m - w) <= 1. / 80. for m, w in zip(moved, wanted, strict=True)), (
        moved, wanted)
    ok("printed")
