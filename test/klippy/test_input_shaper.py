# SPDX-License-Identifier: GPL-3.0-or-later
"""Every step of shaped motion against the model, on each kind of machine."""

import machine_configs
import numpy as np
import pytest
from judge import Judge
from printer_run import PrinterRun
from test_exact_steps import MIXED, PLACE, PREPARE, make_config, make_curves
from truth import machines, polar, shaping

from klippy.errors import PrinterError

SECTION = """
[input_shaper]
shaper_type_x: %s
shaper_freq_x: 52.5
shaper_type_y: %s
shaper_freq_y: 41
damping_ratio_y: 0.06
"""
SHAPED = ("cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz", "delta",
          "deltesian", "rotary_delta", "winch", "generic_cartesian")


def run_shaped(tmp_path, kind, types, job, more="", advance=0.04):
    config = make_config(kind, advance) + SECTION % types + more
    run = PrinterRun(config, tmp_path).run([PREPARE % PLACE[kind], job], 1)
    return Judge(run, config, "G90\nM83\n" + job, run.snapshots[0],
                 extra_limit=machine_configs.find_limits(kind, config))


@pytest.mark.parametrize("kind", SHAPED)
@pytest.mark.parametrize("types", [("mzv", "ei"), ("smooth_mzv", "smooth_ei")])
def test_every_machine(tmp_path, kind, types):
    counts = run_shaped(tmp_path, kind, types, MIXED).check()
    assert min(counts.values()) > 100


@pytest.mark.parametrize("name", shaping.NAMES)
def test_every_shaper(tmp_path, name):
    lines = make_curves().splitlines()[170:240]
    job = "\n".join(["G92 X0 Y0", "G1 F9000", *lines, ""])
    judge = run_shaped(tmp_path, "corexy", (name, name), job)
    assert judge.check()["stepper_x"] > 5000


@pytest.mark.parametrize("mode, scale, offset", [
    ("PRIMARY", 0., 150.), ("COPY", 1., 120.), ("MIRROR", -1., 180.)])
def test_second_carriage(tmp_path, mode, scale, offset):
    config = (machine_configs.make_dual(0.04, machine_configs.BED)
              + SECTION % ("mzv", "smooth_zv"))
    prepare = (PREPARE % (30., 100.) + "SET_DUAL_CARRIAGE CARRIAGE=1\nG1 X150\n"
               "SET_DUAL_CARRIAGE CARRIAGE=0\n")
    if scale:
        prepare += "SET_DUAL_CARRIAGE CARRIAGE=1 MODE=%s\n" % mode
    run = PrinterRun(config, tmp_path).run([prepare, MIXED], 1)
    judge = Judge(run, config, "G90\nM83\n" + MIXED, run.snapshots[0], more={
        "dual_carriage": (lambda p: scale * p[:, 0] + offset, 0.0125)})
    counts = judge.check()
    assert counts["dual_carriage"] == (counts["stepper_x"] if scale else 0)


@pytest.mark.parametrize("before, after", [
    (("zv", 60.), ("smooth_si", 25.)), (("3hump_ei", 25.), ("zv", 60.)),
    (("mzv", 40.), ("mzv", 0.))])
def test_change_in_a_print(tmp_path, before, after):
    """Moves before the command by one shaper, those behind it by the other."""
    section = ("\n[input_shaper]\nshaper_type: %s\nshaper_freq_x: %g\n"
               "shaper_freq_y: 30\n")
    first, second = ("G1 X130 E0.3 F9000\nG1 X90 Y120 E0.4\n",
                     "G1 X110 Y80 E0.5 F9000\nG1 X70 E0.3\n")
    change = "SET_INPUT_SHAPER SHAPER_TYPE_X=%s SHAPER_FREQ_X=%g\n" % after
    base = make_config("corexy")
    run = PrinterRun(base + section % before, tmp_path).run(
        [PREPARE % (100., 100.), first + change, second], 1)
    end = run.snapshots[1].print_time + 0.2
    for part, setting, job, start in ((0, before, first, 0), (1, after, second, 1)):
        config = base + section % setting
        if setting is after:
            config += "shaper_type_y: %s\n" % before[0]
        judge = Judge(run, config, "G90\nM83\n" + job, run.snapshots[start])
        for motor in judge.motors:
            keep = (motor.times > end) == bool(part)
            motor.times, motor.directions = motor.times[keep], motor.directions[keep]
        run.snapshots.append(run.snapshots[part + 1])
        assert judge.check()["stepper_y"] > 3000
        run.snapshots.pop()


FILAMENT = "enabled_extruders: extruder\n"
BELTED = """
[extruder_stepper belted]
extruder: extruder
step_pin: PH0
dir_pin: PH1
microsteps: 16
rotation_distance: 22
pressure_advance: 0.04
"""


@pytest.mark.parametrize("kind, types, advance", [
    ("corexy", ("mzv", "ei"), 0.04), ("cartesian", ("smooth_mzv", "zv"), 0.),
    ("delta", ("2hump_ei", "smooth_ei"), 0.04)])
def test_filament_comes_with_the_head(tmp_path, kind, types, advance):
    job = "\n".join(line for line in MIXED.splitlines()
                    if advance or "ADVANCE" not in line) + "\n"
    counts = run_shaped(tmp_path, kind, types, job, FILAMENT, advance).check()
    assert counts["extruder"] > 100


def test_the_judge_sees_unshaped_filament(tmp_path):
    config = make_config("corexy", 0.04) + SECTION % ("mzv", "ei")
    job = "G1 X130 E0.3 F9000\nG1 X90 Y120 E0.4\n"
    run = PrinterRun(config, tmp_path).run([PREPARE % (100., 100.), job], 1)
    judge = Judge(run, config + FILAMENT, "G90\nM83\n" + job, run.snapshots[0])
    with pytest.raises(AssertionError, match="steps off"):
        judge.check()


@pytest.mark.parametrize("setting, change", [
    ("", "ENABLE_INPUT_SHAPER EXTRUDER=extruder"),
    (FILAMENT, "DISABLE_INPUT_SHAPER EXTRUDER=extruder"),
    (FILAMENT, "DISABLE_INPUT_SHAPER AXIS=x"), (FILAMENT, "DISABLE_INPUT_SHAPER"),
    (FILAMENT, "SET_PRESSURE_ADVANCE ADVANCE=0.09"),
    (FILAMENT, "SYNC_EXTRUDER_MOTION EXTRUDER=extruder MOTION_QUEUE=extruder")])
def test_change_of_use_in_a_print(tmp_path, setting, change):
    """Each half of the print by what held when it began."""
    first, second = ("G1 X130 E0.3 F9000\nG1 X90 Y120 E0.4\n",
                     "G1 X110 Y80 E0.5 F9000\nG1 X70 E0.3\nG1 X80 Y90 E0.2\n")
    shaper = "\n[input_shaper]\nshaper_freq_x: 50\nshaper_freq_y: 36\n"
    advances = (0.04, 0.09 if "ADVANCE" in change else 0.04)
    base = make_config("corexy", advances[0])
    run = PrinterRun(base + shaper + setting, tmp_path).run(
        [PREPARE % (100., 100.), first + change, second], 1)
    changed = {"ENABLE_INPUT_SHAPER EXTRUDER=extruder": shaper + FILAMENT,
               "DISABLE_INPUT_SHAPER EXTRUDER=extruder": shaper,
               "DISABLE_INPUT_SHAPER AXIS=x": shaper.replace("50", "0") + FILAMENT,
               "DISABLE_INPUT_SHAPER": ""}
    end = run.snapshots[1].print_time + 0.2
    for part, section, job in ((0, shaper + setting, first),
                               (1, changed.get(change, shaper + setting), second)):
        judge = Judge(run, make_config("corexy", advances[part]) + section,
                      "G90\nM83\n" + job, run.snapshots[part])
        for motor in judge.motors:
            keep = (motor.times > end) == bool(part)
            motor.times, motor.directions = motor.times[keep], motor.directions[keep]
        run.snapshots.append(run.snapshots[part + 1])
        assert judge.check()["extruder"] > 50
        run.snapshots.pop()


def test_second_motor_is_shaped_with_what_it_follows(tmp_path):
    """By its own section from the start; by SYNC_EXTRUDER_MOTION later on."""
    config = make_config("corexy", 0.04) + SECTION % ("mzv", "ei") + FILAMENT + BELTED
    sync = "SYNC_EXTRUDER_MOTION EXTRUDER=belted MOTION_QUEUE=%s\n"
    run = PrinterRun(config, tmp_path).run(
        [PREPARE % (100., 100.), "G1 X120 E1.1 F9000\n" + sync % "",
         "G1 Y90 E1.1 F9000\n" + sync % "extruder", "G1 X90 Y100 E1.1 F9000\n"], 1)
    drives = [run.get_steps(name) for name in ("extruder", "extruder_stepper belted")]
    marks = [s.print_time + 0.2 for s in run.snapshots[1:3]]
    counts = []
    for low, high in zip([0., *marks], [*marks, 1e9], strict=True):
        parts = [(t[(t > low) & (t < high)], d[(t > low) & (t < high)])
                 for t, d in drives]
        counts.append(tuple(len(t) for t, _ in parts))
        if len(parts[0][0]) == len(parts[1][0]):
            assert abs(parts[0][0] - parts[1][0]).max() < 60e-6
    assert counts[0][0] == counts[0][1] > 100
    assert counts[1][1] == 0 and counts[2][0] == counts[2][1] > 100


def test_status_and_answers(tmp_path):
    config = make_config("cartesian") + "\n[input_shaper]\nshaper_freq_x: 50\n"
    run = PrinterRun(config, tmp_path).run([
        "SET_INPUT_SHAPER SHAPER_FREQ_Y=44.5 SHAPER_TYPE_Y=EI DAMPING_RATIO_Y=0.2"])
    assert any("shaper_type_y:ei shaper_freq_y:44.500 damping_ratio_y:0.200000" in r
               for r in run.responses)
    shaper = run.printer.lookup_object("input_shaper")
    assert shaper.get_status(0.)["x"] == {
        "shaper_type": "mzv", "shaper_freq": 50., "damping_ratio": 0.1}
    assert shaper.get_status(0.)["y"]["shaper_freq"] == 44.5
    assert shaper.get_status(0.)["enabled_extruders"] == []


def test_use_and_answers(tmp_path):
    config = make_config("cartesian") + "\n[input_shaper]\nshaper_freq_x: 50\n"
    run = PrinterRun(config, tmp_path).run([
        "ENABLE_INPUT_SHAPER EXTRUDER=extruder\nDISABLE_INPUT_SHAPER AXIS=XY"])
    assert any("Shaped axes: x; extruders: extruder" in r for r in run.responses)
    assert any("Shaped axes: none; extruders: extruder" in r for r in run.responses)
    status = run.printer.lookup_object("input_shaper").get_status(0.)
    assert status["disabled_axes"] == ["x", "y"]
    assert status["enabled_extruders"] == ["extruder"]


@pytest.mark.parametrize("command, message", [
    ("AXIS=q", "AXIS=q"), ("EXTRUDER=left", "no extruder 'left'"),
    ("EXTRUDER=heater_bed", "no extruder 'heater_bed'")])
def test_refused_use(tmp_path, command, message):
    config = make_config("cartesian") + "\n[input_shaper]\nshaper_freq_x: 50\n"
    with pytest.raises(PrinterError, match=message):
        PrinterRun(config, tmp_path).run(["DISABLE_INPUT_SHAPER " + command])


@pytest.mark.parametrize("command, message", [
    ("SHAPER_TYPE=best", "no shaper 'best'"),
    ("SHAPER_TYPE_X=ei DAMPING_RATIO_X=0.5", "damping ratio 0.5"),
    ("SHAPER_FREQ_X=-1", "SHAPER_FREQ_X")])
def test_refused(tmp_path, command, message):
    config = make_config("cartesian") + "\n[input_shaper]\nshaper_freq_x: 50\n"
    with pytest.raises(PrinterError, match=message):
        PrinterRun(config, tmp_path).run(["SET_INPUT_SHAPER " + command])


@pytest.mark.parametrize("line, message", [
    ("shaper_type: best", "no shaper 'best'"),
    ("shaper_type_x: 3hump_ei\ndamping_ratio_x: 0.3", "damping ratio 0.3"),
    ("shaper_freq_y: -3", "shaper_freq_y"),
    ("enabled_extruders: left", "no extruder 'left'")])
def test_refused_config(tmp_path, line, message):
    config = make_config("cartesian") + "\n[input_shaper]\n" + line + "\n"
    with pytest.raises(PrinterError, match=message):
        PrinterRun(config, tmp_path).run([])


NEAR_CENTRE = """G90
M83
G1 X30 Y20 E0.5 F6000
G1 X-20 Y-15 E1
G1 X-10 Y0.005 E0.3
G1 X12 Y0.005 E0.8
G1 X0.003 Y-0.004 E0.5
G1 X-7 Y9 E0.4
G1 X0.3 Y0.2 E0.3
G1 X-0.2 Y0.3
G1 X20 Y-10 E0.9
"""


@pytest.mark.parametrize("types", [("mzv", "mzv"), ("smooth_mzv", "ei")])
def test_near_the_centre_of_a_bed(tmp_path, types):
    config = make_config("polar") + SECTION % types
    run = PrinterRun(config, tmp_path).run(
        [PREPARE % PLACE["polar"], NEAR_CENTRE], 1)
    start = run.snapshots[0]
    judge = Judge(run, config, NEAR_CENTRE, start,
                  extra_limit=machine_configs.find_limits("polar", config),
                  cut=machine_configs.cut_moves)
    judge.motors = [m for m in judge.motors if m.name != "stepper_bed"]
    assert judge.check()["stepper_arm"] > 3000
    step = machines.step_distance(judge.config["stepper_bed"])
    bed = polar.BedJudge(judge.find_path(), step, judge.tick,
                         4. * np.pi * machine_configs.BED_SPEED)
    times, directions = run.get_steps("stepper_bed")
    late = times > start.print_time
    assert bed.check(times[late], directions[late], start.counts["stepper_bed"],
                     start.origins["stepper_bed"]) >= 2


def test_z(tmp_path):
    more = "shaper_type_z: smooth_zv\nshaper_freq_z: 33\n"
    run_shaped(tmp_path, "delta", ("zv", "zvd"), MIXED, more).check()


def test_the_judge_sees_another_frequency(tmp_path):
    judge = run_shaped(tmp_path, "cartesian", ("mzv", "mzv"), MIXED)
    judge.make_path = shaping.Shaping(
        {"shaper_freq_x": "52.9", "shaper_freq_y": "41"}).make_path
    with pytest.raises(AssertionError):
        judge.check()
