# SPDX-License-Identifier: GPL-3.0-or-later
import pytest
from front_end import make_printer

from klippy.errors import CommandError, CommandInterrupted
from klippy.gcode_run import Run, find_label


@pytest.fixture
def printer():
    made = make_printer()
    yield made
    made.close()


class Waiter:
    """A command that waits for up to 100 s, and those who end it."""

    def __init__(self, printer):
        self.printer, self.ran = printer, []
        printer.gcode.register_command("WAIT", self.wait)
        printer.gcode.register_command("NOTE", self.note)
        printer.gcode.register_command("STOP_WAITS", self.note)
        printer.gcode.register_command("STOP_ALL", self.note)
        interrupts = printer.gcode.interrupts
        interrupts.register("STOP_WAITS", interrupts.end_waits)
        interrupts.register(
            "STOP_ALL", lambda: interrupts.interrupt_others("STOP_ALL"))

    def now(self):
        return self.printer.reactor.monotonic()

    def note(self, gcmd):
        self.ran.append(gcmd.get_commandline())

    def wait(self, gcmd):
        end = self.now() + 100.
        with self.printer.gcode.interrupts.waiting() as wait:
            while not wait.is_ended and self.now() < end:
                wait.pause(min(end, self.now() + 10.))
        self.ran.append(gcmd.get_commandline())

    def start(self, script):
        """Run a script in a greenlet of its own; returns a completion."""
        def call(eventtime):
            try:
                self.printer.gcode.run_script(script)
            except CommandError as err:
                return err
            return None
        return self.printer.reactor.register_callback(call)


@pytest.mark.parametrize("script, label", [
    ("m108", "M108"), (" N12 M108 ", "M108"), ("CANCEL_PRINT A=1", "CANCEL_PRINT"),
    ("M108.1", ""), ("A\nB", ""), ("", ""), ("; M108", ""), ("M1080", "M1080"),
    ("PAUSE_NOW", "PAUSE_NOW"), ("x" * 1000000, "X" * 200)])
def test_label_is_the_only_command(script, label):
    assert find_label(script) == label


def test_wait_is_ended_at_once_and_the_script_goes_on(printer):
    waiter = Waiter(printer)
    started = waiter.now()
    done = waiter.start("WAIT\nNOTE 1")
    printer.run_for(5.)
    printer.gcode.run_script("STOP_WAITS")
    assert done.wait() is None
    assert waiter.ran == ["WAIT", "NOTE 1", "STOP_WAITS"]
    assert waiter.now() - started < 5.1


def test_script_is_ended_within_a_wait_without_an_error(printer):
    waiter = Waiter(printer)
    done = waiter.start("WAIT\nNOTE 1")
    printer.run_for(5.)
    printer.gcode.run_script("STOP_ALL")
    assert isinstance(done.wait(), CommandInterrupted)
    assert waiter.ran == ["STOP_ALL"]
    assert printer.output == ["// Interrupted by STOP_ALL"]
    assert ("gcode:command_error",) not in printer.events
    assert not printer.gcode.mutex.test() and not printer.gcode.mutex.runs


def test_script_is_ended_between_its_lines(printer):
    waiter = Waiter(printer)
    waiter.printer.gcode.register_command(
        "SLEEP", lambda gcmd: printer.reactor.pause(waiter.now() + 2.))
    done = waiter.start("SLEEP\nNOTE 1\nSLEEP\nNOTE 2")
    printer.run_for(3.)
    printer.gcode.run_script("STOP_ALL")
    assert isinstance(done.wait(), CommandInterrupted)
    assert waiter.ran == ["NOTE 1", "STOP_ALL"]


def test_scripts_that_have_not_begun_run_but_do_not_wait(printer):
    waiter = Waiter(printer)
    first, second = waiter.start("WAIT\nNOTE 1"), waiter.start("NOTE 2\nWAIT\nNOTE 3")
    third = waiter.start("NOTE 4")
    printer.run_for(1.)
    started = waiter.now()
    printer.gcode.run_script("STOP_ALL")
    assert isinstance(first.wait(), CommandInterrupted)
    assert isinstance(second.wait(), CommandInterrupted) and third.wait() is None
    assert waiter.ran == ["NOTE 2", "NOTE 4", "STOP_ALL"]
    assert waiter.now() == started


def test_commands_do_not_end_those_of_their_own_kind(printer):
    waiter = Waiter(printer)
    printer.gcode.register_command("STOP_ALL", None)
    printer.gcode.register_command("STOP_ALL", waiter.wait)
    done = waiter.start("STOP_ALL")
    printer.run_for(1.)
    waiter.start("STOP_ALL")
    printer.run_for(1.)
    assert not done.test() and done.wait() is None


def test_script_from_elsewhere_is_not_ended(printer):
    """Who runs commands without the mutex is no part of what is ended."""
    waiter = Waiter(printer)
    done = waiter.start("WAIT")
    printer.run_for(1.)
    printer.gcode.mutex.runs[0].interrupt("for a test")
    printer.gcode.run_script_from_command("NOTE 1\nNOTE 2")
    assert waiter.ran == ["NOTE 1", "NOTE 2"]
    assert isinstance(done.wait(), CommandInterrupted)


def test_emergency_stop_does_not_wait_for_its_turn(printer):
    waiter = Waiter(printer)
    waiter.start("WAIT")
    printer.run_for(1.)
    waiter.start(" m112 ")
    printer.run_for(1.)
    assert printer.state == "shutdown" and "M112" in printer.message
    printer.gcode.interrupts.end_waits()
    printer.run_for(1.)


def test_wait_outside_of_commands_ends_as_well(printer):
    ended = []

    def wait(eventtime):
        with printer.gcode.interrupts.waiting() as wait:
            ended.append(wait.pause(eventtime + 100.) - eventtime)
    printer.reactor.register_callback(wait)
    printer.run_for(1.)
    assert printer.gcode.interrupts.end_waits() == 1
    printer.run_for(1.)
    assert ended == [pytest.approx(1., abs=.01)]
    assert printer.gcode.interrupts.end_waits() == 0


def test_run_without_an_owner_does_not_give_way():
    run = Run("A")
    run.is_holding = True
    run.ask_way()
    assert not run.asked
    run.check()
