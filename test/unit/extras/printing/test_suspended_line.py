# SPDX-License-Identifier: GPL-3.0-or-later
"""Pause, resume and cancel within a line of a print that waits."""

import pytest
from front_end import GCodeMove, Printer, Toolhead, write_file

from klippy import webhooks
from klippy.errors import CommandError


class Job:
    """A print whose macro START waits for WARM, at most 1000 s."""

    def __init__(self, folder, data="START\nNOTE end\n", **macros):
        write_file(folder, "a.gcode", data)
        self.printer = printer = Printer()
        webhooks.setup(printer)
        printer.add_object("gcode_move", GCodeMove(printer))
        printer.add_object("toolhead", Toolhead())
        printer.add_object("heaters", printer.gcode)
        self.ran, self.is_warm = [], False
        for name in ("NOTE", "TURN_OFF_HEATERS"):
            printer.gcode.register_command(name, self.note)
        printer.gcode.register_command("WAIT", self.wait)
        self.sdcard = printer.load("virtual_sdcard", path=str(folder))
        self.stats = printer.lookup_object("print_stats")
        self.pause_resume = printer.load("pause_resume")
        macros = {"START": "NOTE 1\nWAIT\nNOTE 2", **macros}
        for name, gcode in macros.items():
            options = {"gcode": gcode}
            if name in ("PAUSE", "CANCEL_PRINT"):
                options["rename_existing"] = "BASE_" + name
            printer.load("gcode_macro " + name, **options)
        printer.make_ready()

    def note(self, gcmd):
        self.ran.append(gcmd.get_commandline())

    def wait(self, gcmd):
        reactor = self.printer.reactor
        end = reactor.monotonic() + 1000.
        with self.printer.gcode.interrupts.waiting() as wait:
            while not self.is_warm and reactor.monotonic() < end:
                wait.pause(reactor.monotonic() + 1.)

    def script(self, text):
        self.printer.gcode.run_script(text)

    def start(self, seconds=10.):
        self.script("SDCARD_PRINT_FILE FILENAME=a.gcode")
        self.printer.run_for(seconds)

    @property
    def state(self):
        status = self.stats.get_status(self.printer.clock.now)
        return status["state"], self.sdcard.is_active()


@pytest.fixture
def make_job(tmp_path):
    jobs = []

    def make(*args, **macros):
        jobs.append(Job(tmp_path, *args, **macros))
        return jobs[-1]
    yield make
    for job in jobs:
        assert not job.printer.gcode.mutex.test()
        job.printer.close()


@pytest.mark.parametrize("pause, resume", [("PAUSE", "RESUME"), ("M25", "M24")])
def test_pause_within_a_wait_goes_on_from_there(make_job, pause, resume):
    job = make_job()
    job.start()
    before = job.printer.clock.now
    job.script(pause)
    assert job.printer.clock.now == before
    assert job.state == ("paused", False) and job.ran == ["NOTE 1"]
    job.is_warm = True
    job.printer.run_for(100.)
    assert job.state == ("paused", False) and job.ran == ["NOTE 1"]
    job.script("NOTE by hand")
    job.script(resume)
    job.printer.run_for(10.)
    assert job.ran == ["NOTE 1", "NOTE by hand", "NOTE 2", "NOTE end"]
    assert job.state == ("complete", False)
    paused = job.stats.get_status(job.printer.clock.now)
    assert paused["total_duration"] - paused["print_duration"] > 100.


def test_pause_counts_its_time_and_can_come_again(make_job):
    job = make_job()
    job.start()
    for _ in range(3):
        job.script("PAUSE")
        job.printer.run_for(10.)
        assert job.state == ("paused", False) and job.pause_resume.is_paused
        job.script("RESUME")
        job.printer.run_for(10.)
        assert job.state == ("printing", True) and not job.pause_resume.is_paused
    job.is_warm = True
    job.printer.run_for(10.)
    assert job.state == ("complete", False)
    assert job.ran == ["NOTE 1", "NOTE 2", "NOTE end"]


def test_pause_that_does_not_pause_lets_the_line_go_on(make_job):
    job = make_job(PAUSE="NOTE no pause")
    job.start()
    job.script("PAUSE")
    assert job.state == ("printing", True)
    job.is_warm = True
    job.printer.run_for(10.)
    assert job.ran == ["NOTE 1", "NOTE no pause", "NOTE 2", "NOTE end"]
    assert job.state == ("complete", False)


def test_cancel_within_a_wait_ends_the_line(make_job):
    job = make_job()
    job.start()
    before = job.printer.clock.now
    job.script("CANCEL_PRINT")
    assert job.printer.clock.now == before and job.state == ("cancelled", False)
    job.printer.run_for(10.)
    assert job.ran == ["NOTE 1"]
    assert not [text for text in job.printer.output if text.startswith("!!")]
    job.is_warm = True
    job.start()
    assert job.ran == ["NOTE 1", "NOTE 1", "NOTE 2", "NOTE end"]
    assert job.state == ("complete", False)


def test_cancel_while_paused_within_a_wait(make_job):
    job = make_job(CANCEL_PRINT="BASE_CANCEL_PRINT\nNOTE off")
    job.start()
    job.script("PAUSE")
    job.printer.run_for(10.)
    job.script("CANCEL_PRINT")
    assert job.state == ("cancelled", False) and job.ran == ["NOTE 1", "NOTE off"]
    # the macro that was ended may run at once
    job.is_warm = True
    job.script("START")
    job.printer.run_for(10.)
    assert job.ran == ["NOTE 1", "NOTE off", "NOTE 1", "NOTE 2"]


def test_new_print_while_paused_within_a_wait(make_job):
    job = make_job()
    job.start()
    job.script("PAUSE")
    job.is_warm = True
    job.start()
    assert job.ran == ["NOTE 1", "NOTE 1", "NOTE 2", "NOTE end"]
    assert job.state == ("complete", False)


def test_cancel_that_does_not_cancel_pauses(make_job):
    job = make_job(CANCEL_PRINT="NOTE not now")
    job.start()
    job.script("CANCEL_PRINT")
    job.printer.run_for(10.)
    assert job.state == ("paused", False)
    assert "a.gcode:1: Interrupted by CANCEL_PRINT" in "\n".join(job.printer.output)
    job.script("RESUME")
    job.printer.run_for(10.)
    assert job.ran == ["NOTE 1", "NOTE not now", "NOTE end"]


def test_pause_and_cancel_between_the_lines_of_a_macro(make_job):
    job = make_job(START="SLEEP\nNOTE 1\nSLEEP\nNOTE 2")
    reactor = job.printer.reactor
    job.printer.gcode.register_command(
        "SLEEP", lambda gcmd: reactor.pause(reactor.monotonic() + 20.))
    job.start()
    job.script("PAUSE")
    assert job.state == ("paused", False) and job.ran == []
    job.script("RESUME")
    job.printer.run_for(1.)
    assert job.ran == ["NOTE 1"]
    job.script("CANCEL_PRINT")
    assert job.ran == ["NOTE 1"] and job.state == ("cancelled", False)


def test_shutdown_while_paused_within_a_wait(make_job):
    job = make_job()
    job.start()
    job.script("PAUSE")
    job.printer.invoke_shutdown("test")
    job.printer.run_for(10.)
    assert job.state == ("error", False) and job.ran == ["NOTE 1"]


def test_pause_of_a_console_script_waits_for_it(make_job):
    """Only prints are paused; what somebody types goes on."""
    job = make_job()
    done = []
    job.printer.reactor.register_callback(
        lambda eventtime: done.append(job.script("WAIT\nNOTE typed")))
    job.printer.run_for(5.)
    job.printer.reactor.register_callback(
        lambda eventtime: done.append(job.script("PAUSE")))
    job.printer.run_for(5.)
    assert not done and not job.pause_resume.is_paused
    job.is_warm = True
    job.printer.run_for(5.)
    assert done == [None, None] and job.ran == ["NOTE typed"]


def test_cancel_ends_a_console_script(make_job):
    job = make_job()
    errors = []

    def call(eventtime):
        try:
            job.script("WAIT\nNOTE typed")
        except CommandError as err:
            errors.append(str(err))
    job.printer.reactor.register_callback(call)
    job.printer.run_for(5.)
    job.script("CANCEL_PRINT")
    job.printer.run_for(5.)
    assert errors == ["Interrupted by CANCEL_PRINT"] and job.ran == []
