# SPDX-License-Identifier: GPL-3.0-or-later
"""Waits for temperatures that are ended, paused and cancelled on a whole printer."""

import pytest
from machine_configs import BED, make_axes
from printer_run import PrinterRun

from klippy.errors import CommandError

FEATURES = """
[pause_resume]

[virtual_sdcard]
path: {path}

[gcode_macro PRINT_START]
gcode:
    G28
    M190 S60
    G1 X12 F6000

[gcode_macro CANCEL_PRINT]
rename_existing: BASE_CANCEL_PRINT
gcode:
    TURN_OFF_HEATERS
    BASE_CANCEL_PRINT
"""


class Print:
    """A print whose first line homes, waits for the bed, and moves."""

    def __init__(self, printer):
        self.printer = printer
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.gcode.run_script('SDCARD_PRINT_FILE FILENAME="job.gcode"')
        self.wait_until(lambda: self.status("heater_bed")["target"] == 60.)
        self.pause(2.)

    def pause(self, seconds):
        self.reactor.pause(self.reactor.monotonic() + seconds)

    def status(self, name):
        return self.printer.lookup_object(name).get_status(self.reactor.monotonic())

    def position(self):
        return self.printer.lookup_object("toolhead").get_position()[:2]

    def wait_until(self, is_true, seconds=600.):
        end = self.reactor.monotonic() + seconds
        while not is_true():
            assert self.reactor.monotonic() < end
            self.pause(.1)

    def script(self, text):
        """Run a script; returns the s it took."""
        start = self.reactor.monotonic()
        self.gcode.run_script(text)
        return self.reactor.monotonic() - start

    def expect_complete(self):
        self.wait_until(lambda: self.status("print_stats")["state"] != "printing")
        assert self.status("print_stats")["state"] == "complete"
        assert self.position() == [20., 5.]


@pytest.fixture
def run_print(tmp_path):
    def run(story, errors=()):
        (tmp_path / "job.gcode").write_text("PRINT_START\nG1 X20 Y5\n")
        config = make_axes("cartesian", extra=BED) + FEATURES.format(path=tmp_path)
        printed = PrinterRun(config, tmp_path).run([lambda p: story(Print(p))])
        told = [text for text in printed.responses if text.startswith("!!")]
        assert told == list(errors)
    return run


def test_m108_goes_on_with_a_cold_bed(run_print):
    def story(job):
        assert job.script("M108") < .5
        job.expect_complete()
        assert job.status("heater_bed")["temperature"] < 50.
    run_print(story)


def test_pause_and_resume_keep_waiting(run_print):
    def story(job):
        assert job.script("PAUSE") < .5
        assert job.status("print_stats")["state"] == "paused"
        before = job.position()
        job.script("G1 X8 F6000")
        job.pause(120.)
        assert job.status("heater_bed")["temperature"] > 58.
        assert job.status("print_stats")["state"] == "paused"
        job.script("RESUME")
        job.wait_until(lambda: job.position() != before, 5.)
        job.expect_complete()
    run_print(story)


def test_cancel_ends_the_wait_and_the_macro(run_print):
    def story(job):
        before = job.position()
        assert job.script("CANCEL_PRINT") < .5
        job.pause(30.)
        assert job.status("print_stats")["state"] == "cancelled"
        assert job.status("heater_bed")["target"] == 0.
        assert job.position() == before
        # the next print is none the worse for it
        job.__init__(job.printer)
        job.expect_complete()
    run_print(story)


def test_calibration_that_is_ended_leaves_the_heater_off(run_print):
    def story(job):
        job.script("M108")
        job.expect_complete()
        errors = []

        def calibrate(eventtime):
            try:
                job.gcode.run_script("PID_CALIBRATE HEATER=heater_bed TARGET=60")
            except CommandError as err:
                errors.append(str(err))
        for command in ("M108", "CANCEL_PRINT"):
            job.reactor.register_callback(calibrate)
            job.pause(5.)
            assert job.status("heater_bed")["target"] > 50.
            job.script(command)
            job.pause(1.)
            assert job.status("heater_bed")["target"] == 0.
        assert errors == ["pid_calibrate interrupted", "Interrupted by CANCEL_PRINT"]
    run_print(story, ["!! pid_calibrate interrupted"])
