# SPDX-License-Identifier: GPL-3.0-or-later
import pytest
from front_end import make_printer

from klippy.errors import CommandError


@pytest.fixture
def printer():
    made = make_printer(
        ("idle_timeout", {"timeout": "60", "gcode": "ECHO idle"}), motion=True)
    yield made
    made.close()


def move(printer, seconds):
    """Have the toolhead move from now on."""
    now = printer.clock.now
    printer.lookup_object("toolhead").end_time = now + seconds
    printer.send_event("toolhead:sync_print_time", now, now, now + 0.2)


def state(printer):
    return printer.lookup_object("idle_timeout").get_status(printer.clock.now)["state"]


def named(printer, name):
    return [event for event in printer.events if event[0] == "idle_timeout:" + name]


def test_states(printer):
    assert state(printer) == "Idle"
    printer.run_for(100.)
    assert state(printer) == "Idle" and not printer.output
    start = printer.clock.now
    move(printer, 10.)
    printer.run_for(9.)
    status = printer.lookup_object("idle_timeout").get_status(printer.clock.now)
    assert status["state"] == "Printing" and status["idle_timeout"] == 60.
    assert status["printing_time"] == pytest.approx(9.)
    assert named(printer, "printing") == [
        ("idle_timeout:printing", pytest.approx(start + 0.1))]
    printer.run_for(3.)
    assert state(printer) == "Ready" and len(named(printer, "ready")) == 1
    printer.run_for(56.)
    assert state(printer) == "Ready" and not printer.output
    printer.run_for(10.)
    assert state(printer) == "Idle" and printer.output == ["// ECHO idle"]
    assert len(named(printer, "idle")) == 1


def test_waiting_moves_and_commands_keep_it_printing(printer):
    toolhead = printer.lookup_object("toolhead")
    move(printer, 1.)
    toolhead.is_empty = False
    printer.run_for(20.)
    assert state(printer) == "Printing"
    toolhead.is_empty = True
    printer.gcode.register_command("WAIT", lambda gcmd: printer.reactor.pause(
        printer.reactor.monotonic() + 300.))
    printer.reactor.register_callback(lambda e: printer.gcode.run_script("WAIT"))
    printer.run_for(200.)
    assert state(printer) == "Printing"
    printer.run_for(110.)
    assert state(printer) == "Ready"


def test_set_idle_timeout(printer):
    move(printer, 1.)
    printer.run_for(5.)
    printer.gcode.run_script("SET_IDLE_TIMEOUT TIMEOUT=600")
    printer.run_for(300.)
    assert state(printer) == "Ready"
    printer.gcode.run_script("SET_IDLE_TIMEOUT TIMEOUT=1")
    printer.run_for(5.)
    assert state(printer) == "Idle"
    with pytest.raises(CommandError, match="above 0"):
        printer.gcode.run_script("SET_IDLE_TIMEOUT TIMEOUT=0")


def test_error_of_its_gcode_still_leads_to_idle():
    printer = make_printer(("idle_timeout", {"timeout": "5", "gcode": "\1"}),
                           motion=True)
    move(printer, 1.)
    printer.run_for(30.)
    assert state(printer) == "Idle" and printer.output[0].startswith("!!")
    printer.close()
