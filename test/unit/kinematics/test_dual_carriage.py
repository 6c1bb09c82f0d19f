# SPDX-License-Identifier: GPL-3.0-or-later
"""Two carriages on an axis: where both really go, on the simulated machine."""

import pathlib
import random

import motion_bench
import pytest

from klippy.errors import CommandError
from klippy.kinematics.carriages import invert_rows
from klippy.kinematics.generic_cartesian import parse_carriages

CONFIG = pathlib.Path(__file__).resolve().parents[3] / "config"
HALF = 0.0126
# Names of the carriages in both samples
NAMES = {"dual_carriage": ("x", "dual_carriage"), "generic_cartesian": ("x", "u")}
HYBRID = (CONFIG / "sample-dual_carriage.cfg").read_text().replace(
    "kinematics: cartesian", "kinematics: hybrid_corexy")


@pytest.fixture(params=[*NAMES, "hybrid"])
def bench(request, tmp_path, monkeypatch):
    if request.param == "hybrid":
        made = motion_bench.MotionBench(tmp_path, monkeypatch, HYBRID)
    else:
        text = (CONFIG / ("sample-%s.cfg" % request.param)).read_text()
        made = motion_bench.MotionBench(tmp_path, monkeypatch, text)
    made.names = NAMES.get(request.param, NAMES["dual_carriage"])
    return made


def places(it):
    """Where the two carriages really are."""
    it.toolhead.wait_moves()
    it.pause(0.1)
    found = it.machine.axes.calc_carriages(it.machine.get_step_counts())
    return [found[name] for name in it.names]


def assert_at(it, first, second):
    assert places(it) == pytest.approx([first, second], abs=HALF)


def modes(it):
    return [it.get("dual_carriage")["carriage_%d" % i] for i in (0, 1)]


def refuse(it, line, words):
    with pytest.raises(CommandError, match=words):
        it.send(line)


def test_homing_and_primary(bench):
    def body(it):
        assert modes(it) == ["PRIMARY", "INACTIVE"]
        it.send("G28")
        assert modes(it) == ["PRIMARY", "INACTIVE"]
        assert_at(it, -40., 240.)
        assert it.get("toolhead")["homed_axes"] == "xyz"
        assert it.get("toolhead")["axis_maximum"][0] == 200.
        it.send("G1 X30 Y20 F6000\nSET_DUAL_CARRIAGE CARRIAGE=1")
        assert modes(it) == ["INACTIVE", "PRIMARY"]
        assert it.get("dual_carriage")["carriages"] == dict(
            zip(it.names, modes(it), strict=True))
        assert it.get("toolhead")["position"][0] == pytest.approx(240.)
        # 40 mm to the other one, which rests at 30
        assert it.get("toolhead")["axis_minimum"][0] == pytest.approx(70., abs=HALF)
        it.send("G1 X120 Y50")
        assert_at(it, 30., 120.)
        refuse(it, "G1 X69", "X 69.000 is not within 70.000 to 240.000")
        it.send("G28 Y")
        assert_at(it, 30., 120.)
        it.send("SET_DUAL_CARRIAGE CARRIAGE=%s MODE=primary" % it.names[0])
        assert it.get("toolhead")["position"][0] == pytest.approx(30.)
        refuse(it, "G1 X81", "X 81.000 is not within -40.000 to 80.000")
        it.send("G1 X70")
        assert_at(it, 70., 120.)
    bench.run_ready(body)


def test_copy_and_mirror(bench):
    def body(it):
        refuse(it, "SET_DUAL_CARRIAGE CARRIAGE=1 MODE=COPY", "Must home axis X")
        it.send("G28\nG1 X0 F9000\nSET_DUAL_CARRIAGE CARRIAGE=1\nG1 X100")
        it.send("SET_DUAL_CARRIAGE CARRIAGE=0\nSET_DUAL_CARRIAGE CARRIAGE=1 MODE=COPY")
        assert modes(it) == ["PRIMARY", "COPY"]
        it.send("G1 X50 Y60\nG1 X20 Y10")
        assert_at(it, 20., 120.)
        assert it.get("toolhead")["axis_maximum"][0] == pytest.approx(140.)
        refuse(it, "G1 X141", "Move out of range")
        refuse(it, "SET_DUAL_CARRIAGE CARRIAGE=0 MODE=MIRROR", "cannot follow itself")
        it.send("SET_DUAL_CARRIAGE CARRIAGE=1 MODE=MIRROR\nG1 X40 Y30")
        assert_at(it, 40., 100.)
        # they meet at 70 and keep 40 mm apart
        assert it.get("toolhead")["axis_maximum"][0] == pytest.approx(50., abs=HALF)
        refuse(it, "G1 X51", "Move out of range")
        it.send("SET_DUAL_CARRIAGE CARRIAGE=0\nG1 X10")
        assert_at(it, 10., 100.)
        refuse(it, "SET_DUAL_CARRIAGE CARRIAGE=2", "none of the dual carriages")
        refuse(it, "SET_DUAL_CARRIAGE CARRIAGE=1 MODE=PARK", "none of PRIMARY, COPY")
    bench.run_ready(body)


def test_too_close_to_follow(bench):
    def body(it):
        it.send("G28\nG1 X20 F9000\nSET_DUAL_CARRIAGE CARRIAGE=1\nG1 X70")
        it.send("SET_DUAL_CARRIAGE CARRIAGE=0")
        for carriage in it.toolhead.get_kinematics().carriages:
            carriage.safe_distance = 60. if carriage.primary else 0.
        refuse(it, "SET_DUAL_CARRIAGE CARRIAGE=1 MODE=COPY",
               "are 50.000 apart, which is less than safe_distance, 60.000")
        assert modes(it) == ["PRIMARY", "INACTIVE"]
    bench.run_ready(body)


def test_distance_that_leaves_no_room(tmp_path, monkeypatch):
    def body(it):
        assert "no room for 'x', which could go from -40.000 to -60.000" in (
            it.printer.state_message)
    text = GENERIC.replace("safe_distance: 40", "safe_distance: 300")
    motion_bench.MotionBench(tmp_path, monkeypatch, text).run(body)


def test_save_and_restore(bench):
    def body(it):
        refuse(it, "RESTORE_DUAL_CARRIAGE_STATE NAME=a", "No state .* saved as 'a'")
        it.send("G28\nG1 X0 F9000\nSET_DUAL_CARRIAGE CARRIAGE=1\nG1 X100")
        it.send("SET_DUAL_CARRIAGE CARRIAGE=0\nSET_DUAL_CARRIAGE CARRIAGE=1 MODE=COPY")
        it.send("SAVE_DUAL_CARRIAGE_STATE NAME=a\nG1 X30\n"
                "SET_DUAL_CARRIAGE CARRIAGE=1\nG1 X220")
        it.send("RESTORE_DUAL_CARRIAGE_STATE NAME=a MOVE=0")
        assert_at(it, 30., 220.)
        assert modes(it) == ["PRIMARY", "COPY"]
        it.send("RESTORE_DUAL_CARRIAGE_STATE NAME=a MOVE_SPEED=100")
        assert_at(it, 0., 100.)
        assert modes(it) == ["PRIMARY", "COPY"]
        it.send("G1 X5")
        assert_at(it, 5., 105.)
    bench.run_ready(body)


def test_nothing_drifts(bench):
    def body(it):
        draw = random.Random(3)
        it.send("G28\nG1 X20.003 F12000")
        at = [20.003, 240.]
        for _ in range(60):
            active = draw.choice([0, 1])
            it.send("SET_DUAL_CARRIAGE CARRIAGE=%d" % active)
            low, high = (-40., at[1] - 41.) if active == 0 else (at[0] + 41., 240.)
            at[active] = round(draw.uniform(low, min(high, 200. + 40. * active)), 3)
            it.send("G1 X%.3f Y%.3f" % (at[active], draw.uniform(0., 100.)))
        assert_at(it, *at)
    bench.run_ready(body)


# Motors and carriages in general


def test_sums_of_carriages():
    names = ["x", "y", "z", "u1"]
    for text, wanted in (
            ("x", {"x": 1.}), ("x+y", {"x": 1., "y": 1.}),
            (" y - 0.5*z ", {"y": 1., "z": -0.5}), ("-x+u1", {"x": -1., "u1": 1.}),
            ("2*x + .5 * y", {"x": 2., "y": 0.5}), ("x+x", {"x": 2.})):
        assert parse_carriages(text, names) == wanted
    for text, words in (("x y", "should be a sum"), ("x+", "should be a sum"),
                        ("w", "there is no carriage 'w', only x, y, z, u1"),
                        ("x*2", "should be a sum"), ("x-x", "moves no carriage"),
                        ("", "moves no carriage")):
        with pytest.raises(CommandError, match=words):
            parse_carriages(text, names)


def test_carriages_by_motors():
    assert invert_rows([[1., 1.], [1., -1.]], ["x", "y"], "") == [[.5, .5], [.5, -.5]]
    # two motors of one carriage: their mean
    assert invert_rows([[1.], [1.]], ["y"], "") == [[.5, .5]]
    with pytest.raises(CommandError, match="do not tell where carriage 'y' is"):
        invert_rows([[1., 1.], [2., 2.]], ["x", "y"], "The motors")


GENERIC = (CONFIG / "sample-generic_cartesian.cfg").read_text()


@pytest.mark.parametrize("before, after, words", [
    ("carriages: u+y", "carriages: x+y", "do not tell where carriage"),
    ("carriages: u+y", "carriages: u+w", "no carriage 'w', only x, y, z, u, y1"),
    ("[carriage z]", "[carriage w]\naxis: x", "second one is a [dual_carriage]"),
    ("primary_carriage: x", "primary_carriage: v", "'v'"),
    ("[extra_carriage y1]", "[extra_carriage z]", "carriage 'z' is there already"),
])
def test_generic_errors(tmp_path, monkeypatch, before, after, words):
    def body(it):
        assert it.printer.state == "error"
        assert words in it.printer.state_message, it.printer.state_message
    assert before in GENERIC
    motion_bench.MotionBench(tmp_path, monkeypatch, GENERIC.replace(before, after)
                             ).run(body)


def test_generic_endstops_and_new_weights(tmp_path, monkeypatch):
    def body(it):
        kin = it.toolhead.get_kinematics()
        stops = {name: sorted(s.get_name().split()[1] for s in endstop.get_steppers())
                 for endstop, name in kin.endstops}
        assert stops == {"x": ["a"], "u": ["b"], "y": ["a", "b", "left"],
                         "y1": ["right"], "z": ["z"]}
        it.send("G28\nG1 X20 Y30 F6000\nM400")
        it.pause(0.1)
        refuse(it, "SET_STEPPER_CARRIAGES STEPPER=a CARRIAGES=y",
               "do not tell where carriage 'x' is")
        refuse(it, "SET_STEPPER_CARRIAGES STEPPER=c CARRIAGES=y", "none of this")
        before = it.machine.get_step_counts()["stepper a"]
        it.send("SET_STEPPER_CARRIAGES STEPPER='stepper a' CARRIAGES=x\n"
                "G1 X30 Y60\nM400")
        it.pause(0.1)
        # 10 mm of x alone
        assert it.machine.get_step_counts()["stepper a"] - before == 800
    motion_bench.MotionBench(tmp_path, monkeypatch, GENERIC).run_ready(body)
