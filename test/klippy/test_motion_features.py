# SPDX-License-Identifier: GPL-3.0-or-later
"""Every step of features around motion, against a job that does the same plainly."""

import random

import machine_configs
import pytest
from judge import Judge
from printer_run import PrinterRun
from truth import advance, machines

PREPARE = "G28\nG90\nM83\nG1 X100 Y100 Z3 F6000\n"
ARM = """
[manual_stepper arm]
step_pin: PH0
dir_pin: PH1
microsteps: 16
rotation_distance: 32
"""


def run_judged(tmp_path, sections, setup, job, plain, kind="cartesian", **options):
    """Run setup and job; check all steps of the job against the plain one."""
    config = machine_configs.make_axes(kind, 0.04, machine_configs.BED + sections)
    run = PrinterRun(config, tmp_path).run([PREPARE, setup, job], 2)
    for snapshot in run.snapshots:
        snapshot.position = snapshot.position[:4]
    judge = Judge(run, config, "G90\nM83\n" + plain, run.snapshots[1], **options)
    return judge.check()


def draw_points(seed, count=60):
    """Corners of a random walk: x, y, z, mm of filament, speed (mm/min)."""
    draw = random.Random(seed)
    return [(draw.uniform(60., 140.), draw.uniform(60., 140.), draw.uniform(1., 9.),
             draw.choice([0., 0., draw.uniform(0., .6)]),
             draw.choice([1500, 6000, 15000])) for _ in range(count)]


def write_moves(points, extra=lambda x, y, z: ""):
    return "".join("G1 X%.11f Y%.11f Z%.11f%s%s F%d\n" % (
        x, y, z, " E%.5f" % (e,) if e else "", extra(x, y, z), f)
        for x, y, z, e, f in points)


@pytest.mark.parametrize("kind", ["cartesian", "corexy"])
def test_an_extra_axis_keeps_step_with_the_head(tmp_path, kind):
    points = draw_points(1)
    job = write_moves(points, lambda x, y, z: " A%.11f" % (0.5 * x - y + 50.,))
    # the walk of the arm is a function of the place of the head
    more = {"manual_stepper arm": (lambda p: 0.5 * p[:, 0] - p[:, 1] + 50., 0.01)}
    counts = run_judged(
        tmp_path, ARM, "MANUAL_STEPPER STEPPER=arm GCODE_AXIS=A"
        " INSTANTANEOUS_CORNER_VELOCITY=10000", job, write_moves(points), kind,
        more=more)
    assert counts["manual_stepper arm"] > 10000


def test_skew(tmp_path):
    points = draw_points(2)
    # factors from the angles that the lengths of SET_SKEW describe
    xy, xz, yz = 0.012, -0.02, 0.015
    setup = "SET_SKEW " + " ".join(
        "%s=%.13f,%.13f,100" % (plane, *calc_diagonals(factor))
        for plane, factor in (("XY", xy), ("XZ", xz), ("YZ", yz)))
    bent = [(x - xy * (y - yz * z) - xz * z, y - yz * z, z, e, f)
            for x, y, z, e, f in points]
    run_judged(tmp_path, "[skew_correction]\n", setup, write_moves(points),
               write_moves(bent))


def calc_diagonals(factor, side=100., height=100.):
    """AC and BD of a parallelogram whose other side leans by a factor."""
    lean = factor * height
    return (((side + lean) ** 2 + height ** 2) ** .5,
            ((side - lean) ** 2 + height ** 2) ** .5)


def test_firmware_retraction(tmp_path):
    points = draw_points(3, 40)
    lines = write_moves(points).splitlines(keepends=True)
    job = "".join(lines[i] + ("G10\n", "G11\n")[i % 2] for i in range(len(lines)))
    plain = "".join(
        line + ("G1 E-1.7 F2100\nG1 F%d\n", "G1 E1.75 F1500\nG1 F%d\n")[i % 2]
        % (points[i][4],) for i, line in enumerate(lines))
    # extruding while it is drawn back is no matter here
    run_judged(tmp_path, "[firmware_retraction]\nretract_length: 1.7\n"
               "retract_speed: 35\nunretract_extra_length: 0.05\n"
               "unretract_speed: 25\n", "", job, plain)


def test_tuning_tower(tmp_path):
    job = plain = ""
    for layer in range(12):
        z, advance = 1. + 0.5 * layer, 0.01 + 0.005 * (1. + 0.5 * layer)
        moves = ["G1 X%g E0.5 F4800\n" % x for x in (120., 80., 130., 100.)]
        up = "G1 Z%g F600\n" % z
        job += up + "".join(moves)
        plain += up + "SET_PRESSURE_ADVANCE ADVANCE=%.9f\n" % advance + "".join(moves)
    run_judged(tmp_path, "", "TUNING_TOWER COMMAND=SET_PRESSURE_ADVANCE"
               " PARAMETER=ADVANCE START=0.01 FACTOR=0.005", job, plain)


def test_the_judge_sees_a_wrong_ratio(tmp_path):
    points = draw_points(1, 10)
    job = write_moves(points, lambda x, y, z: " A%.11f" % (0.5 * x - y + 50.,))
    more = {"manual_stepper arm": (lambda p: 0.5003 * p[:, 0] - p[:, 1] + 50., 0.01)}
    with pytest.raises(AssertionError):
        run_judged(tmp_path, ARM, "MANUAL_STEPPER STEPPER=arm GCODE_AXIS=A"
                   " INSTANTANEOUS_CORNER_VELOCITY=10000", job, write_moves(points),
                   more=more)


MODELS = {
    "tanh": ("pressure_advance_model: tanh\nlinear_advance: 0.03\n"
             "nonlinear_offset: 0.15\nlinearization_velocity: 2\n",
             dict(model="tanh", offset=0.15, velocity=2.)),
    "recipr": ("pressure_advance_model: recipr\nlinear_advance: 0.03\n"
               "nonlinear_offset: 0.2\nlinearization_velocity: 5\n"
               "pressure_advance_time_offset: 0.03\n",
               dict(model="recipr", offset=0.2, velocity=5., time_offset=0.03)),
    "late": ("pressure_advance_model: tanh\nlinear_advance: 0.03\n"
             "pressure_advance_time_offset: -0.02\n", dict(time_offset=-0.02))}


def judge_model(tmp_path, options, model, linear=0.03):
    """Steps of a job whose drive leads by a model."""
    # the truth takes the advance of 1 for "this is led"
    config = machine_configs.make_axes("corexy", 1., machine_configs.BED)
    config = config.replace("[extruder]\n", "[extruder]\n" + options)
    job = write_moves(draw_points(4)) + "G1 E-1 F2400\nG1 X90 F9000\nG1 E1 F2400\n"
    job += "".join("G1 X%.3f Y%.3f E0.05 F3000\n" % (90. + 0.7 * i, 80. + i % 3)
                   for i in range(40))
    run = PrinterRun(config, tmp_path).run([PREPARE, job], 1)
    reach = 0.04 + 2. * abs(model.get("time_offset", 0.))
    judge = Judge(run, config, "G90\nM83\n" + job, run.snapshots[0], reach)
    step_dist = machines.step_distance(judge.config["extruder"])
    judge.motors[-1] = judge._make_motor(
        "extruder", lambda path, t: advance.position(path, t, linear, 0.04, **model),
        step_dist)
    return judge.check()["extruder"]


@pytest.mark.parametrize("name", MODELS)
def test_curved_pressure_advance(tmp_path, name):
    assert judge_model(tmp_path, *MODELS[name]) > 1000


def test_a_second_drive_leads_in_its_own_way(tmp_path):
    second = ("[extruder_stepper b]\nextruder: extruder\nstep_pin: PH0\ndir_pin: PH1\n"
              "microsteps: 32\nrotation_distance: 20\npressure_advance: 0.1\n"
              "pressure_advance_smooth_time: 0.06\n")
    config = machine_configs.make_axes("cartesian", 0.05, machine_configs.BED + second)
    job = write_moves(draw_points(6))
    run = PrinterRun(config, tmp_path).run([PREPARE, job], 1)
    judge = Judge(run, config, "G90\nM83\n" + job, run.snapshots[0], 0.06)
    own = judge.config["extruder"], judge.config["extruder_stepper b"]
    judge.motors[-1:] = [
        judge._make_motor(name, lambda path, t, f=factor, s=smooth: path.extruder(
            t, f, s), machines.step_distance(section))
        for name, section, factor, smooth in (
            ("extruder", own[0], 1., 0.04), ("extruder_stepper b", own[1], 2., 0.06))]
    assert judge.check()["extruder_stepper b"] > 2000


@pytest.mark.parametrize("wrong", [
    dict(offset=0.151), dict(velocity=2.02), dict(time_offset=0.001),
    dict(model="recipr")])
def test_the_judge_sees_another_curve(tmp_path, wrong):
    options, model = MODELS["tanh"]
    with pytest.raises(AssertionError):
        judge_model(tmp_path, options, {**model, **wrong})
