# SPDX-License-Identifier: GPL-3.0-or-later
"""How late steps are is also known of motors that rest for long."""

import lateness
import machine_configs
import pytest
from printer_run import PrinterRun

# In turns of the 32 bits by which a command tells a clock
RESTS = (0.55, 0.45)
JOB = "G90\nG1 X%d Y20 F3000\nG4 P%d\nG1 X%d F3000\nG4 P%d\nG1 X%d Y40\nM400\n"


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """(run, what was measured): one motor rests twice for half a turn, another once
    for a whole one."""
    run = PrinterRun(machine_configs.make_axes("cartesian"),
                     tmp_path_factory.mktemp("rests"), seed=0)
    link = run.machine.mcus["mcu"].link
    link.record()
    turn = 2**32 / run.freq
    first, second = (1000 * rest * turn for rest in RESTS)
    run.run(["G28", JOB % (20, first, 30, second, 40)], 1)
    return run, lateness.measure(run)


@pytest.mark.parametrize("name", ["stepper_x", "stepper_y"])
def test_steps_after_a_rest(name, measured):
    run, found = measured
    due, late = found[name]
    made = run.steps[name][:, 0]
    gaps = (made[1:] - made[:-1]).max() / 2**32
    print("%s: rests of %.2f turns, %d to %d ticks late" % (
        name, gaps, late.min(), late.max()))
    assert gaps > 0.5
    assert late.min() >= 0 and late.max() <= run.freq * 25e-6
    assert (due == made - late).all() and (due[1:] > due[:-1]).all()
