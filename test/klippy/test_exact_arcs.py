# SPDX-License-Identifier: GPL-3.0-or-later
"""Every step of a printer on arcs, against a model that knows G-code only."""

import math
import random

import machine_configs
import numpy as np
import pytest
from judge import Judge
from printer_run import PrinterRun

PLACE = {"cartesian": (100., 100.), "corexy": (100., 100.), "delta": (0., 0.),
         "winch": (0., 0.), "generic_cartesian": (100., 100.),
         "limited_cartesian": (100., 100.), "limited_corexy": (100., 100.),
         "deltesian": (0., 100.), "rotary_delta": (0., 0.), "polar": (60., 0.)}
# In other planes than x, y these machines make segments
LEVEL = ("delta", "rotary_delta", "polar")
ARCS = "\n[gcode_arcs]\n"
PREPARE = "G28\nG90\nM83\nG1 X%g Y%g Z30 F6000\n"
# Around X0 Y0; Z 30 to 31
SHAPES = """
G1 X20 Y0 F9000
G3 X0 Y20 I-20 J0 E1.2
G1 X-15 E0.4
G3 X-20 Y15 I0 J-5 E0.3
G1 Y-15 E0.6
G2 X-20 Y-15 I8 J3 E1.5 F18000
G2 X20 Y-15 I20 J0 Z30.6 E2
G3 X20 Y-15 I-3 J4 Z31
M204 S1500
G3 X22 Y-13 I0 J2 E0.02 F3000
G1 Y10
G2 X2.3 Y5.71 R40 E0.7 F6000
G2 X2.3 Y5.71 I0.05 J0.02
G18
G3 X12.3 Y5.71 Z31 I5 K0 F9000
G19
G2 X12.3 Y15.71 Z31 J5 K0 E0.2
G17
G1 X0 Y0 Z30
"""


def make_config(kind, advance=0.04, extra=ARCS):
    extra = machine_configs.BED + extra
    if kind == "delta":
        return machine_configs.make_delta(advance, extra)
    if kind == "generic_cartesian":
        return machine_configs.make_generic(advance, extra)
    if kind.startswith("limited_"):
        return machine_configs.make_limited(kind, advance, extra)
    if kind in machine_configs.CURVED:
        return machine_configs.make_curved(kind, advance, extra)
    return machine_configs.make_axes(kind, advance, extra)


def run_arcs(tmp_path, kind, job, config=None, tolerance=25e-6):
    config = config or make_config(kind)
    x, y = PLACE[kind]
    prepare = PREPARE % (x, y) + "G92 X0 Y0\n"
    run = PrinterRun(config, tmp_path).run([prepare, job], 1)
    return run, Judge(run, config, "G90\nM83\nG92 X0 Y0\n" + job, run.snapshots[0],
                      extra_limit=machine_configs.find_limits(kind, config),
                      cut=machine_configs.cut_moves if kind == "polar" else None,
                      tolerance=tolerance)


def expand_radius(job):
    """The model knows middles only: R by its definition."""
    lines, at = [], [0., 0.]
    for line in job.splitlines():
        words = dict((w[0], float(w[1:])) for w in line.split()[1:] if w[0] in "XYR")
        end = [words.get("X", at[0]), words.get("Y", at[1])]
        if "R" in words:
            half = 0.5 * math.dist(at, end)
            height = math.sqrt(words["R"] ** 2 - half ** 2) / (2. * half)
            sign = 1. if line.startswith("G2") else -1.
            dx, dy = end[0] - at[0], end[1] - at[1]
            line = line.replace("R%g" % words["R"], "I%.17g J%.17g" % (
                0.5 * dx + sign * height * dy, 0.5 * dy - sign * height * dx))
        lines.append(line)
        at = end
    return "\n".join(lines) + "\n"


JOB = expand_radius(SHAPES)
FLAT = "".join(line + "\n" for line in JOB[:JOB.index("G18")].splitlines())


@pytest.mark.parametrize("kind", PLACE)
def test_every_step_of_arcs(tmp_path, kind):
    _, judge = run_arcs(tmp_path, kind, FLAT if kind in LEVEL else JOB)
    counts = judge.check()
    assert min(counts.values()) > 50


AROUND = """
G1 X-40 Y20 F9000
G3 X-40 Y20 I-20 J-20 F12000
G1 X-55 Y0 E0.3
G2 X-55 Y0 I-5 J0 E0.3
G3 X-57.4 Y0 I-1.2 J0 E0.2
G3 X-57.4 Y0 I-2.6 J0 E0.2
G1 X0 Y0 Z30
"""


def test_arcs_around_the_centre_of_a_bed(tmp_path):
    """The centre is X-60 Y0; small rounds are limited by the bed."""
    _, judge = run_arcs(tmp_path, "polar", AROUND)
    counts = judge.check()
    assert counts["stepper_bed"] > 20000
    assert judge.find_path().rate.any()


SHAPED = """
[input_shaper]
shaper_type_x: %s
shaper_freq_x: 52.5
shaper_type_y: %s
shaper_freq_y: 41
damping_ratio_y: 0.06
"""


IMPULSES, KERNELS = ("mzv", "ei"), ("smooth_mzv", "smooth_ei")
slow = pytest.mark.slow


@pytest.mark.parametrize("kind, types", [
    ("corexy", IMPULSES), ("delta", IMPULSES), ("corexy", KERNELS),
    pytest.param("cartesian", IMPULSES, marks=slow),
    pytest.param("cartesian", KERNELS, marks=slow),
    pytest.param("deltesian", IMPULSES, marks=slow),
    pytest.param("generic_cartesian", IMPULSES, marks=slow),
    pytest.param("polar", IMPULSES, marks=slow),
    pytest.param("delta", KERNELS, marks=slow)])
def test_every_step_of_shaped_arcs(tmp_path, kind, types):
    config = make_config(kind, extra=ARCS + SHAPED % types)
    _, judge = run_arcs(tmp_path, kind, FLAT if kind in LEVEL else JOB, config)
    counts = judge.check()
    assert min(counts.values()) > 50
    assert judge.find_path().rate.any()


def test_judge_sees_arcs_in_chords(tmp_path):
    """Of 1 mm: the same job, had the arcs not been shaped as they are."""
    config = make_config("corexy", extra=ARCS + "native: False\n"
                         + SHAPED % ("mzv", "ei"))
    _, judge = run_arcs(tmp_path, "corexy", FLAT, config)
    with pytest.raises(AssertionError):
        judge.check()


FILAMENT = "enabled_extruders: extruder\n"


@pytest.mark.parametrize("kind, types", [
    ("corexy", IMPULSES), pytest.param("cartesian", KERNELS, marks=slow),
    pytest.param("delta", IMPULSES, marks=slow),
    pytest.param("corexy", ("mzv", "mzv"), marks=slow)])
def test_every_step_of_shaped_filament(tmp_path, kind, types):
    """Its shares of x and y change all along an arc."""
    config = make_config(kind, extra=ARCS + SHAPED % types + FILAMENT)
    _, judge = run_arcs(tmp_path, kind, FLAT if kind in LEVEL else JOB, config)
    assert judge.check()["extruder"] > 500


def test_arcs_that_wait_when_filament_is_shaped_no_more(tmp_path):
    """They are made as when they were given."""
    shaper = SHAPED % IMPULSES
    config = make_config("corexy", extra=ARCS + shaper + FILAMENT)
    job = "G1 X20 Y0 E0.2 F6000\nG3 X0 Y20 I-20 J0 E1.2\n"
    run = PrinterRun(config, tmp_path).run(
        [PREPARE % PLACE["corexy"] + "G92 X0 Y0\n",
         job + "DISABLE_INPUT_SHAPER EXTRUDER=extruder\n", job], 1)
    judge = Judge(run, config, "G90\nM83\nG92 X0 Y0\n" + job, run.snapshots[0])
    path = judge.find_path()
    extruder = next(m for m in judge.motors if m.name == "extruder")
    until = path.t1[-1] + 0.2
    assert until < run.snapshots[1].print_time + 1.
    extruder.times = extruder.times[extruder.times < until]
    extruder.directions = extruder.directions[:len(extruder.times)]
    assert len(extruder.times) > 100
    judge._check_motor(extruder, path)


def test_judge_sees_a_little_more_accel_towards_the_middle(tmp_path):
    run, judge = run_arcs(tmp_path, "cartesian", FLAT)
    config = make_config("cartesian").replace("max_accel: 4000", "max_accel: 4040")
    with pytest.raises(AssertionError):
        Judge(run, config, "G90\nM83\nG92 X0 Y0\n" + FLAT, run.snapshots[0]).check()


def make_random(seed, count, reach):
    """Arcs, helices and lines within a square of 2 * reach around X0 Y0."""
    draw, lines, at = random.Random(seed), [], (0., 0.)
    while len(lines) < count:
        radius = 10. ** draw.uniform(-0.7, 1.5)
        heading = draw.uniform(-math.pi, math.pi)
        middle = (at[0] + radius * math.cos(heading),
                  at[1] + radius * math.sin(heading))
        if max(map(abs, middle)) + radius > reach:
            continue
        turned = draw.uniform(-math.pi, math.pi)
        end = (round(middle[0] + radius * math.cos(turned), 3),
               round(middle[1] + radius * math.sin(turned), 3))
        if math.dist(at, end) < 0.1 * radius:
            end = at
        filament = " E%.4f" % draw.choice([0., 0.01 * radius])
        lines.append("%s X%.3f Y%.3f I%.4f J%.4f F%d%s%s" % (
            draw.choice(["G2", "G3"]), *end, middle[0] - at[0], middle[1] - at[1],
            draw.choice([600, 3000, 9000, 18000]), filament,
            draw.choice(["", "", " Z%.2f" % draw.uniform(29., 31.)])))
        at = end
        if draw.random() < 0.3:
            at = (round(draw.uniform(-reach, reach), 3),
                  round(draw.uniform(-reach, reach), 3))
            lines.append("G1 X%.3f Y%.3f F9000" % at)
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("kind", ["cartesian", "corexy", "delta"])
def test_random_arcs(tmp_path, kind):
    _, judge = run_arcs(tmp_path, kind, make_random(4, 60, 40.))
    check_limits(judge)
    judge.check()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["cartesian", "corexy", "delta", "deltesian",
                                  "limited_corexy"])
@pytest.mark.parametrize("seed", range(20))
def test_many_random_arcs(tmp_path, kind, seed):
    _, judge = run_arcs(tmp_path, kind, make_random(100 + seed, 400, 60.))
    judge.check()


def check_limits(judge):
    """The exact path, sampled: speed and accel across the way keep their limits."""
    path, h = judge.find_path(), 1e-4
    velocity, accel = (float(judge.config["printer"]["max_" + name])
                       for name in ("velocity", "accel"))
    at = np.arange(path.t0[0], path.t1[-1], 1e-3)
    index, _ = path._locate(at)
    inside = ((at - 2. * h > path.t0[index]) & (at + 2. * h < path.t1[index])
              & (path.rate[index] != 0.))
    at = at[inside]
    before, middle, after = (path.xyz(at + d) for d in (-h, 0., h))
    speed = (after - before) / (2. * h)
    pull = (after - 2. * middle + before) / (h * h)
    size = np.linalg.norm(speed, axis=1)
    along = (pull * speed).sum(axis=1) / np.maximum(size, 1e-9)
    across = np.sqrt(np.maximum((pull ** 2).sum(axis=1) - along ** 2, 0.))
    assert len(at) > 1000
    assert size.max() <= velocity * (1. + 1e-6)
    assert 0.9 * accel < across.max() <= accel * 1.002


def test_arcs_are_one_move(tmp_path):
    """Fewer bytes on the wire than by segments, and less time."""
    results = []
    for native in ("True", "False"):
        folder = tmp_path / native
        folder.mkdir()
        config = make_config("corexy", extra=ARCS + "native: %s\n" % native)
        run, _ = run_arcs(folder, "corexy", "G3 X0 Y0 I-30 J0 F6000\n" * 3, config)
        times, directions = run.get_steps("stepper_x")
        results.append((len(times), times[-1]))
    assert abs(results[0][0] - results[1][0]) < 0.01 * results[0][0]
