# SPDX-License-Identifier: GPL-3.0-or-later
"""A host that does nothing for a while, at random moments of arcs."""

import pytest
from judge import Judge
from printer_run import PrinterRun
from test_exact_arcs import PREPARE, make_config, make_random
from test_late_host import SLOW, StallingRun, measure_stops

START = PREPARE % (100., 100.) + "G92 X0 Y0\n"


def print_arcs(tmp_path, stall, seed):
    config, path = make_config("cartesian"), tmp_path / "job.gcode"
    path.write_text(make_random(seed, 150, 40.))
    run = StallingRun(config, tmp_path, stall, seed).run([START, path], 1)
    assert run.count_late_events() == 0
    return config, path, run


def test_short_stalls_leave_no_trace_on_arcs(tmp_path):
    config, path, run = print_arcs(tmp_path, 2., 1)
    assert run.n_stalls > 8
    assert run.printer.lookup_object("toolhead").print_stall == 0
    Judge(run, config, "G90\nM83\nG92 X0 Y0\n" + path.read_text(),
          run.snapshots[0]).check()


@pytest.mark.parametrize("stall", [4., None])
def test_motion_stops_and_goes_on_along_arcs(tmp_path, stall):
    """The planned stop lies on the arc: no step is lost, and it is slow there."""
    config, path, run = print_arcs(tmp_path, stall, 2)
    plain = PrinterRun(config, tmp_path).run([START, path], 1)
    assert run.snapshots[-1].position == plain.snapshots[-1].position
    assert run.snapshots[-1].counts == plain.snapshots[-1].counts
    assert stall is None or run.printer.lookup_object("toolhead").print_stall > 3
    assert all(measure_stops(run) < SLOW)
