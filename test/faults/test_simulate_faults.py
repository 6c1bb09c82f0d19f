# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy simulate` ends with status 1 and a clear text where a job cannot go on."""

import pytest
from machine_configs import BED, make_axes

from klippy.cli import main

GOOD = make_axes("cartesian", extra=BED)
SKIP = "[virtual_sdcard]\npath: /tmp\non_command_error: skip\n"
START = "G28\nG1 X10 F6000\n"


def simulate(folder, config, job):
    """Exit status of a run."""
    (folder / "printer.cfg").write_text(config)
    (folder / "job.gcode").write_text(job)
    return main(["simulate", str(folder / "printer.cfg"), str(folder / "job.gcode")])


@pytest.mark.parametrize("line, wanted", [
    ("G1 X500", "FAILED: job.gcode:3: Move out of range"),
    ("G1 X1.2.3", "FAILED: job.gcode:3: Error on 'G1 X1.2.3'"),
    ("PAUSE", "FAILED: The print paused, and nothing had it go on for 3600 s"),
    ("CANCEL_PRINT", "FAILED: Print cancelled"),
    ("M112", "FAILED: Shutdown due to M112"),
])
def test_job_that_cannot_go_on(tmp_path, capsys, line, wanted):
    assert simulate(tmp_path, GOOD, START + line + "\nG1 X20\n") == 1
    assert wanted in capsys.readouterr().out


def test_job_whose_bad_lines_are_skipped(tmp_path, capsys):
    assert simulate(tmp_path, GOOD + SKIP, START + "G1 X500\nG1 X20\n") == 0
    text = capsys.readouterr().out
    assert "Done." in text and "End position     X20.0000" in text
    assert [line.split() for line in text.splitlines() if "Skipped" in line] == [
        ["Skipped", "lines", "1"]]


@pytest.mark.parametrize("option, wanted", [
    ("gear_ratio: 0:1", "'0:1' must be two numbers above 0"),
    ("gear_ratio: five", "'five' has 1 elements"),
    ("full_steps_per_rotation: 0", "'0' must be at least 1"),
])
def test_config_error_names_its_line(tmp_path, capsys, option, wanted):
    config = GOOD.replace("microsteps: 16\n", "microsteps: 16\n%s\n" % option, 1)
    line = config[:config.index(option)].count("\n") + 1
    assert simulate(tmp_path, config, START) == 1
    text = capsys.readouterr().err
    assert "printer.cfg:%d: " % line in text and wanted in text
