# SPDX-License-Identifier: GPL-3.0-or-later
"""Every step of shaped motion against the model, on each kind of machine."""

import machine_configs
import pytest
from judge import Judge
from printer_run import PrinterRun
from test_exact_steps import MIXED, PLACE, PREPARE, make_config, make_curves
from truth import shaping

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
    ("shaper_freq_y: -3", "shaper_freq_y")])
def test_refused_config(tmp_path, line, message):
    config = make_config("cartesian") + "\n[input_shaper]\n" + line + "\n"
    with pytest.raises(PrinterError, match=message):
        PrinterRun(config, tmp_path).run([])


def test_z(tmp_path):
    more = "shaper_type_z: smooth_zv\nshaper_freq_z: 33\n"
    run_shaped(tmp_path, "delta", ("zv", "zvd"), MIXED, more).check()


def test_the_judge_sees_another_frequency(tmp_path):
    judge = run_shaped(tmp_path, "cartesian", ("mzv", "mzv"), MIXED)
    judge.make_path = shaping.Shaping(
        {"shaper_freq_x": "52.9", "shaper_freq_y": "41"}).make_path
    with pytest.raises(AssertionError):
        judge.check()
