# SPDX-License-Identifier: GPL-3.0-or-later
"""Every step at the pins against a model that knows G-code and config only."""

import math
import pathlib
import random
import re

import machine_configs
import pytest
from judge import Judge
from printer_run import PrinterRun

SAMPLES = pathlib.Path(__file__).resolve().parents[2] / "config" / "samples"
LINEAR = ("cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz")
KINDS = (*LINEAR, "delta", *machine_configs.CURVED, "generic_cartesian")
# Where jobs begin, and from the samples' bed to there
PLACE = {**dict.fromkeys(KINDS, (100., 100.)), "delta": (0., 0.),
         "deltesian": (0., 100.), "polar": (60., 50.), "rotary_delta": (0., 0.),
         "winch": (0., 0.)}
CENTRE = {kind: (x - 100., y - 100.) for kind, (x, y) in PLACE.items()}
EDGE = 80.
PREPARE = "G28\nG90\nM83\nG1 X%g Y%g Z3 F6000\n"

MIXED = """
G91
M83
G1 X20 Y7.5 F9000
G1 X10 E0.4 F2400
G1 Y10 E0.4
G1 X-5.33 Y-3.1 E0.2
G1 E-0.8 F2400
G1 Z0.4 F900
G1 X-12 Y3 F18000
G1 Z-0.4 F900
G1 E0.8 F1800
SET_PRESSURE_ADVANCE ADVANCE=0.02
G1 X8 E0.5 F3000
SET_PRESSURE_ADVANCE ADVANCE=0.08
G1 X8 Y0.5 E0.5
G4 P250
M204 S1200
G1 X-15 Y-5 E0.9 F4800
SET_VELOCITY_LIMIT SQUARE_CORNER_VELOCITY=1 MINIMUM_CRUISE_RATIO=0.8
G1 X-5 E0.3
G1 Y4 E0.3
G1 X4 Z0.3 E0.3
SET_VELOCITY_LIMIT VELOCITY=40 ACCEL=600 MINIMUM_CRUISE_RATIO=0
M400
G1 X3.123 Y-9.4 F9000
G1 X0.01
G1 X0.02 E0.001
G1 X-3
G1 X3
"""


def make_config(kind, advance=0.04):
    if kind == "delta":
        return machine_configs.make_delta(advance, machine_configs.BED)
    if kind == "generic_cartesian":
        return machine_configs.make_generic(advance, machine_configs.BED)
    if kind in machine_configs.CURVED:
        return machine_configs.make_curved(kind, advance, machine_configs.BED)
    return machine_configs.make_axes(kind, advance, machine_configs.BED)


def run_job(tmp_path, kind, job, advance=0.04, seed=1):
    """Home, go to the middle, run the job; returns (PrinterRun, Judge)."""
    config = make_config(kind, advance)
    run = PrinterRun(config, tmp_path, seed).run([PREPARE % PLACE[kind], job], 1)
    start = run.snapshots[0]
    judge = Judge(run, config, "G90\nM83\n" + job, start,
                  extra_limit=machine_configs.find_limits(kind, config),
                  cut=machine_configs.cut_moves if kind == "polar" else None)
    return run, judge


def make_curves():
    """A spiral of tiny moves, an eight and a random walk."""
    draw, lines = random.Random(5), ["G92 X0 Y0", "G1 F4800"]
    for i in range(150):
        angle, radius = 0.15 * i, 2. + 0.06 * i
        lines.append("G1 X%.3f Y%.3f E0.03" % (radius * math.cos(angle),
                                               radius * math.sin(angle)))
    for i in range(60):
        angle = 0.1047 * i
        lines.append("G1 X%.3f Y%.3f Z%.3f F12000" % (
            30. * math.sin(angle), 15. * math.sin(2. * angle),
            3. + 0.5 * math.sin(angle)))
    for _ in range(80):
        lines.append("G1 X%.2f Y%.2f E%.3f F%d" % (
            draw.uniform(-30., 30.), draw.uniform(-30., 30.), draw.uniform(0., .2),
            draw.choice([600, 3000, 9000, 18000])))
    return "\n".join(lines) + "\n"


def cut_sample(name, kind, n_lines=None):
    """(part to home and heat, part to print) of a sample, moved to the centre."""
    text = (SAMPLES / name).read_text()
    first, rest = re.split(r"(?m)^G28\b.*\n", text, maxsplit=1)
    lines = [line for line in rest.splitlines()[:n_lines]
             if not line.startswith("G28")]
    return first + "G28\n", "".join(shift(line, *CENTRE[kind]) + "\n"
                                      for line in lines)


def shift(line, dx, dy):
    """A G0 or G1 line elsewhere, but not further than EDGE."""
    if not line.startswith(("G0 ", "G1 ")) or not (dx or dy):
        return line
    for axis, way in (("X", dx), ("Y", dy)):
        if not way:
            continue
        line = re.sub(axis + r"(-?[\d.]+)",
                      lambda m, a=axis, d=way: "%s%.4f" % (
                          a, max(-EDGE, min(float(m[1]) + d, EDGE))), line)
    return line


def print_sample(tmp_path, name, kind, advance, n_lines=None):
    """Print a sample by the virtual SD card and check every step."""
    config = make_config(kind, advance)
    before, job = cut_sample(name, kind, n_lines)
    path = tmp_path / "job.gcode"
    path.write_text(job)
    run = PrinterRun(config, tmp_path).run([before, path], 1)
    judge = Judge(run, config, job, run.snapshots[0],
                  extra_limit=machine_configs.find_limits(kind, config),
                  cut=machine_configs.cut_moves if kind == "polar" else None)
    return judge.check()


@pytest.mark.parametrize("advance", [0., 0.04])
@pytest.mark.parametrize("kind", KINDS)
def test_mixed_job(tmp_path, kind, advance):
    job = MIXED if advance else re.sub("SET_PRESSURE.*\n", "", MIXED)
    _, judge = run_job(tmp_path, kind, job, advance)
    counts = judge.check()
    assert min(counts.values()) > 100


@pytest.mark.parametrize("kind", KINDS)
def test_curves(tmp_path, kind):
    _, judge = run_job(tmp_path, kind, make_curves())
    assert judge.check()["extruder"] > 1500


def test_edge_of_a_delta(tmp_path):
    job = "G1 X118 F18000\n" + "".join(
        "G1 X%.3f Y%.3f F18000\n" % (118. * math.cos(a), 118. * math.sin(a))
        for a in (0.3 * i for i in range(10))) + "G1 X60 Y0\nG1 X121 Y5\n"
    run, judge = run_job(tmp_path, "delta", job)
    judge.check()
    judge.extra_limit = None
    with pytest.raises(AssertionError):
        judge.check()


@pytest.mark.parametrize("mode, scale, offset", [
    ("PRIMARY", 0., 150.), ("COPY", 1., 120.), ("MIRROR", -1., 180.)])
def test_second_carriage(tmp_path, mode, scale, offset):
    config = machine_configs.make_dual(0.04, machine_configs.BED)
    prepare = (PREPARE % (30., 100.) + "SET_DUAL_CARRIAGE CARRIAGE=1\nG1 X150\n"
               "SET_DUAL_CARRIAGE CARRIAGE=0\n")
    if scale:
        prepare += "SET_DUAL_CARRIAGE CARRIAGE=1 MODE=%s\n" % mode
    run = PrinterRun(config, tmp_path).run([prepare, MIXED], 1)
    judge = Judge(run, config, "G90\nM83\n" + MIXED, run.snapshots[0], more={
        "dual_carriage": (lambda p: scale * p[:, 0] + offset, 0.0125)})
    counts = judge.check()
    assert counts["dual_carriage"] == (counts["stepper_x"] if scale else 0)


# What the host may be wrong about the second clock (s), by how far apart both go
CLOCK_ERRORS = {"mcu=0, tool=0": 2e-6, "mcu=200, tool=-200": 20e-6}


@pytest.mark.parametrize("ppm", CLOCK_ERRORS)
@pytest.mark.parametrize("job", [MIXED, make_curves()], ids=["mixed", "curves"])
def test_every_step_of_two_mcus(tmp_path, ppm, job):
    config = (machine_configs.make_two_mcus()
              + "[simulator]\nclock_ppm: %s\n" % (ppm,))
    run = PrinterRun(config, tmp_path).run(
        [PREPARE % PLACE["cartesian"], "G4 P20000", job], 2)
    assert run.owners["extruder"] == "tool"
    judge = Judge(run, config, "G90\nM83\n" + job, run.snapshots[1],
                  clock_errors={"extruder": CLOCK_ERRORS[ppm]})
    assert judge.check()["extruder"] > 500
    # it is the clock of the other mcu that counts
    run.owners = {}
    with pytest.raises(AssertionError):
        Judge(run, config, "G90\nM83\n" + job, run.snapshots[1]).check()


def test_past_the_centre_of_a_bed(tmp_path):
    job = "".join("G1 X%g Y%g E0.2 F6000\n" % point for point in (
        (-60., -49.), (-60., 0.5), (60., 0.5), (3., -0.2), (-3., 0.4), (0.4, 0.4),
        (0.4, -40.), (-0.1, 40.)))
    _, judge = run_job(tmp_path, "polar", job)
    assert judge.check()["stepper_bed"] > 40000
    # it is slow there: nothing is as planned without that
    judge.cut = None
    with pytest.raises(AssertionError):
        judge.check()


@pytest.mark.parametrize("kind", KINDS)
def test_first_layers_of_a_sample(tmp_path, kind):
    counts = print_sample(tmp_path, "cube20.gcode", kind, 0.04, 700)
    assert min(counts.values()) > 500


@pytest.mark.parametrize("n_lines", [15, 17, 20])
def test_sample_cut_before_it_prints(tmp_path, n_lines):
    counts = print_sample(tmp_path, "cube20.gcode", "cartesian", 0.04, n_lines)
    assert counts["extruder"] > 100 and counts["stepper_z"] > 3500


@pytest.mark.slow
@pytest.mark.parametrize("advance", [0., 0.04])
@pytest.mark.parametrize("kind", KINDS)
def test_whole_sample(tmp_path, kind, advance):
    counts = print_sample(tmp_path, "cube20.gcode", kind, advance)
    assert sum(counts.values()) > 1000000


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two_objects.gcode", "vase_s.gcode"])
def test_other_samples(tmp_path, name):
    counts = print_sample(tmp_path, name, "corexy", 0.04)
    assert sum(counts.values()) > 300000


@pytest.mark.parametrize("option, value", [
    ("max_accel", "4040"), ("square_corner_velocity", "5.1"), ("max_z_accel", "204"),
    ("minimum_cruise_ratio", "0.52"), ("max_extrude_only_accel", "1900"),
    ("instantaneous_corner_velocity", "0.95"), ("pressure_advance", "0.041")])
def test_judge_sees_small_differences(tmp_path, option, value):
    run, _ = run_job(tmp_path, "cartesian", MIXED)
    config = make_config("cartesian")
    section = "printer" if option in machine_configs.PRINTER_OPTIONS else "extruder"
    config = config.replace("[%s]\n" % section,
                            "[%s]\n%s: %s\n" % (section, option, value))
    config = re.sub(r"(?m)^%s: (?!%s$).*\n" % (option, re.escape(value)), "", config)
    judge = Judge(run, config, "G90\nM83\n" + MIXED, run.snapshots[0])
    with pytest.raises(AssertionError):
        judge.check()


@pytest.mark.parametrize("kind, before, after", [
    ("deltesian", "arm_length: 260", "arm_length: 260.1"),
    ("polar", "gear_ratio: 80:16", "gear_ratio: 80.01:16"),
    ("rotary_delta", "shoulder_height: 400", "shoulder_height: 400.1"),
    ("winch", "anchor_z: 1500", "anchor_z: 1501")])
def test_judge_sees_another_geometry(tmp_path, kind, before, after):
    run, _ = run_job(tmp_path, kind, MIXED)
    config = make_config(kind)
    assert before in config
    limits = machine_configs.find_limits(kind, config)
    judge = Judge(run, config.replace(before, after), "G90\nM83\n" + MIXED,
                  run.snapshots[0], extra_limit=limits)
    with pytest.raises(AssertionError):
        judge.check()
