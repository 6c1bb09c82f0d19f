# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps that batch mode writes are those that a machine does."""

import os
import re

import machine_configs
import numpy as np
import pytest
from batch import BatchRun, decode_steps, read_lines, run_batch
from dictionaries import DICTIONARIES, build_dictionary
from judge import Judge
from printer_run import PrinterRun
from truth.steps import TOLERANCE

START = "SET_KINEMATIC_POSITION X=%(x)s Y=%(y)s Z=5\nG90\nM83\nG92 E0\n"
# Moves in groups; between groups the machine rests for a while.
GROUPS = ("G91\nG1 X20 Y7 F6000\nG1 X10 E0.5 F2400\nG1 Y12 E0.6\nG1 X-11 Y-3 E0.5\n",
          "G1 E-0.8 F2400\nG1 Z0.4 F600\nG1 X-9 Y2 F12000\nG1 Z-0.4 F600\nG1 E0.8\n",
          "".join("G1 X%.3f Y%.3f E0.02 F3000\n" % (
              np.cos(0.1 * i), np.sin(0.1 * i)) for i in range(120)))
SHAPER = "\n[input_shaper]\nshaper_freq_x: 48\nshaper_freq_y: 37\n"
N_DENSE = 1600
PAUSE = "G4 P1500\n"


def use_own_pins(config):
    """The config with the firmware's own names of pins."""
    return re.sub(r"P([A-F])(\d)", lambda m: "gpio%d" % (
        8 * (ord(m[1]) - ord("A")) + int(m[2])), config)


def find_pins(config):
    """{stepper section: step pin}."""
    found = re.findall(r"\[(\w+)\]\nstep_pin: (\w+)", config)
    return dict(found)


@pytest.fixture(scope="module")
def dictionary():
    return build_dictionary(DICTIONARIES / "simulator.dict")


@pytest.mark.parametrize("kind, shaper", [
    ("cartesian", ""), ("corexy", ""), ("delta", ""), ("corexy", SHAPER),
    ("delta", SHAPER)])
def test_same_steps(tmp_path, dictionary, kind, shaper):
    print_both_ways(tmp_path, dictionary, kind, shaper, GROUPS)


@pytest.mark.parametrize("kind", ["corexy", "delta"])
def test_same_arcs(tmp_path, dictionary, kind):
    x, y = (0, 0) if kind == "delta" else (100, 100)
    groups = ["G90\nG1 X%g Y%g F6000\nG3 X%g Y%g I-20 J0 E1\nG2 X%g Y%g I-7 J-4 Z6\n"
              % (x + 20, y, x, y + 20, x, y + 20), "G2 X%g Y%g I0 J-20 E2 F12000\n"
              % (x, y - 20)]
    print_both_ways(tmp_path, dictionary, kind, "\n[gcode_arcs]\n", groups)


@pytest.mark.parametrize("kind", [
    "cartesian", pytest.param("delta", marks=pytest.mark.slow)])
def test_dense_file(tmp_path, dictionary, kind):
    """0.05 mm moves at 300 mm/s: in one go, and as fast as planned."""
    seen = print_both_ways(tmp_path, dictionary, kind, "", [draw_round()],
                           {"stepper_z"} if kind == "cartesian" else ())
    path = seen.find_path()
    assert len(path.t0) > N_DENSE
    # 80 mm at 300 mm/s, and the ramps of 300 / 4000 s or 300 / 3000 s
    ramp = 300. / (3000. if kind == "delta" else 4000.)
    assert path.t1[-1] - path.t0[0] == pytest.approx(
        N_DENSE * 0.05 / 300. + ramp, abs=0.002)


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="needs two processors")
def test_the_number_of_processors_changes_no_byte(tmp_path, dictionary):
    config = use_own_pins(machine_configs.make_axes(
        "corexy", 0.04, machine_configs.BED + "\n[force_move]\nenable_force_move: True"
        "\n" + SHAPER))
    job = START % {"x": 100, "y": 100} + PAUSE.join([*GROUPS, draw_round()])
    every = sorted(os.sched_getaffinity(0))
    outputs = [run_batch(config, job, dictionary, tmp_path, cores).read_bytes()
               for cores in (every[:1], every)]
    assert len(outputs[0]) > 5000
    assert outputs[0] == outputs[1]


def draw_round():
    """Part of a round with a radius of 50 mm, in N_DENSE moves of 0.05 mm."""
    points = [(50. * np.sin(0.001 * i), 50. - 50. * np.cos(0.001 * i))
              for i in range(N_DENSE + 1)]
    moves = np.diff(np.round(points, 5), axis=0)
    return "G91\n" + "".join("G1 X%.5f Y%.5f E0.0015 F18000\n" % (x, y)
                             for x, y in moves)


def print_both_ways(tmp_path, dictionary, kind, shaper, groups, still=()):
    """Print groups of moves live and in batch mode, and compare the steps.

    still: names of steppers that rest.  Returns the Judge of the live run,
    which found no fault.
    """
    extra = (machine_configs.BED + "\n[force_move]\nenable_force_move: True\n"
             + shaper)
    make = machine_configs.make_delta if kind == "delta" else (
        lambda *args: machine_configs.make_axes(kind, *args))
    config = use_own_pins(make(0.04, extra))
    head = START % ({"x": 0, "y": 0} if kind == "delta" else {"x": 100, "y": 100})
    job = PAUSE.join(groups)
    output = run_batch(config, head + job, dictionary, tmp_path)
    steps = decode_steps(read_lines(output, dictionary))
    live = PrinterRun(config, tmp_path).run([head, job])
    batch = BatchRun(steps, find_pins(config), live)
    begins, judges = [], []
    for run in (live, batch):
        judge = Judge(run, config, "G90\nM83\n" + job, run.snapshots[0],
                      extra_limit=machine_configs.find_limits(kind, config))
        counts = judge.check()
        assert {name for name, count in counts.items() if count <= 100} == set(still)
        begins.append(judge.begins)
        judges.append(judge)
    assert len(begins[0]) == len(groups)
    for seen, written in zip(*(judge.motors for judge in judges), strict=True):
        compare(seen, written, *begins, 1. / live.freq)
    return judges[0]


def compare(seen, written, seen_begins, written_begins, tick):
    """Same steps in the same order, at the same times after the start.

    Either may be off the exact time by the bound, to different sides.
    """
    assert np.array_equal(seen.directions, written.directions), seen.name
    if not len(seen.times):
        return
    # The drive leads the head by less than this
    group = np.searchsorted(np.array(seen_begins) - 0.1, seen.times) - 1
    assert np.all(group >= 0)
    difference = ((seen.times - np.array(seen_begins)[group])
                  - (written.times - np.array(written_begins)[group]))
    assert np.abs(difference).max() <= 2. * (TOLERANCE + tick), seen.name
