# SPDX-License-Identifier: GPL-3.0-or-later
"""The real host prints with the linux firmware in real time.

LINUX_SESSION_S=60 makes it move for a minute instead of some seconds, LINUX_OPTIONS=-r
adds options of the firmware.
"""

import os
import time

import pytest
from linux_board import build_linux
from linux_machine import Machine

SESSION = float(os.environ.get("LINUX_SESSION_S", "1"))  # s
STEP_MM = 1. / 80.


@pytest.fixture
def machine(tmp_path):
    machine = Machine(build_linux(), tmp_path, "--max-late", "10000",
                      *os.environ.get("LINUX_OPTIONS", "").split())
    yield machine
    assert machine.stop() == 0


def home(machine):
    """Home, and take the motors' positions there as origin."""
    machine.printer.gcode("G28")
    assert machine.printer.status("toolhead")["homed_axes"] == "xyz"
    machine.printer.gcode("G90\nG1 X10 Y10 Z2 F3000\nM400")
    return [p - q for p, q in zip(machine.positions(), (10., 10., 2.), strict=True)]


def check_at(machine, origin, *place):
    got = [p - o for p, o in zip(machine.positions(), origin, strict=True)]
    assert got == pytest.approx(place, abs=STEP_MM)


def move_for(machine, seconds):
    """Squares with diagonals until the time is over; they end at 20, 30."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        machine.printer.gcode(
            "G1 X40 Y10 F6000\nG1 X40 Y40\nG1 X10 Y40\nG1 X10 Y10\n"
            "G1 X35.5 Y37.25 Z3\nG1 X20 Y30 Z2\nM400")


@pytest.mark.slow
def test_session(machine):
    printer = machine.printer
    printer.wait_state("ready")
    origin = home(machine)
    printer.gcode("SET_HEATER_TEMPERATURE HEATER=hotend TARGET=60")
    printer.gcode("TEMPERATURE_WAIT SENSOR='heater_generic hotend' MINIMUM=58")
    assert machine.hotend.temperature > 55.
    move_for(machine, SESSION)
    check_at(machine, origin, 20., 30., 2.)

    printer.restart("gcode/restart")
    printer.wait_state("ready")
    origin = home(machine)
    check_at(machine, origin, 10., 10., 2.)

    boots = machine.io.boots
    printer.gcode("SET_HEATER_TEMPERATURE HEATER=hotend TARGET=60")
    printer.call("emergency_stop")
    printer.wait_state("shutdown")
    assert machine.io.level("gpio20") == 0
    with pytest.raises(RuntimeError, match="hutdown"):
        printer.gcode("G28")
    printer.restart("gcode/firmware_restart")
    printer.wait_state("ready")
    assert machine.io.boots > boots
    origin = home(machine)
    move_for(machine, .1)
    check_at(machine, origin, 20., 30., 2.)
