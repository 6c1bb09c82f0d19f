# SPDX-License-Identifier: GPL-3.0-or-later
"""Cartesian and corexy machines, and those without axes."""

import pathlib

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError
from klippy.kinematics import corexy, linear

COREXY = CARTESIAN.replace("kinematics: cartesian", "kinematics: corexy")
NONE = "[mcu]\nserial: /dev/none\n[printer]\nkinematics: none\n" \
    "max_velocity: 100\nmax_accel: 100\n"
CONFIG = pathlib.Path(__file__).resolve().parents[3] / "config"


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(config=CARTESIAN):
        return motion_bench.MotionBench(tmp_path, monkeypatch, config)
    return make


def test_inverse():
    weights = ((1., 2., 0.), (0., 1., -1.), (3., 0., 1.))
    inverse = linear.invert(weights)
    for i, row in enumerate(inverse):
        for j in range(3):
            product = sum(row[k] * weights[k][j] for k in range(3))
            assert product == pytest.approx(float(i == j))


def test_positions_of_a_corexy():
    inverse = linear.invert(corexy.WEIGHTS)
    assert inverse[0] == [0.5, 0.5, 0.] and inverse[1] == [0.5, -0.5, 0.]


def stops(it):
    """{name of an endstop: names of the steppers it stops}."""
    return {name: [s.get_name()[-1] for s in endstop.get_steppers()]
            for rail in it.toolhead.get_kinematics().rails
            for endstop, name in rail.get_endstops()}


def test_cartesian_state(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        assert stops(it) == {"x": ["x"], "y": ["y"], "z": ["z"]}
        assert it.get("toolhead")["axis_maximum"] == (200., 200., 200., 0.)
        it.send("G28")
        assert it.get("toolhead")["homed_axes"] == "xyz"
        positions = {s.get_name(): s.get_commanded_position()
                     for s in kin.get_steppers()}
        assert kin.calc_position(positions) == pytest.approx(
            it.toolhead.get_position()[:3], abs=0.02)
        kin.note_z_not_homed()
        assert it.get("toolhead")["homed_axes"] == "xy"
        with pytest.raises(CommandError, match=r"Must home axis first.*Z is not homed"):
            it.send("G1 Z20")
        it.send("G1 X20")
        it.send("M84")
        assert it.get("toolhead")["homed_axes"] == ""
    make_bench().run_ready(body)


def test_z_speed(make_bench):
    def body(it):
        it.send("G28")
        start = it.toolhead.get_last_move_time()
        it.send("G1 Z50.5 F30000")
        # 50 mm at 25 mm/s, 100 mm/s^2, and the way to speed up
        assert it.toolhead.get_last_move_time() - start == pytest.approx(2.25, abs=0.02)
    make_bench().run_ready(body)


def test_corexy_moves_and_stops_both_motors(make_bench):
    def body(it):
        assert stops(it) == {"x": ["x", "y"], "y": ["y", "x"], "z": ["z"]}
        it.send("G28")
        it.send("G1 X50 Y50 F6000")
        it.toolhead.wait_moves()
        it.pause(0.1)
        before = it.machine.get_step_counts()
        it.send("G1 X60")
        it.toolhead.wait_moves()
        it.pause(0.1)
        after = it.machine.get_step_counts()
        assert after["stepper_x"] - before["stepper_x"] == 800
        assert after["stepper_y"] - before["stepper_y"] == 800
        assert max(it.get_error()) <= 0.0125
        positions = {s.get_name(): s.get_commanded_position()
                     for s in it.toolhead.get_kinematics().get_steppers()}
        assert it.toolhead.get_kinematics().calc_position(positions) == pytest.approx(
            it.toolhead.get_position()[:3], abs=0.0125)
    make_bench(COREXY).run_ready(body)


@pytest.mark.parametrize("kind, stopped", [
    ("corexz", {"x": ["x", "z"], "y": ["y"], "z": ["z", "x"]}),
    ("hybrid_corexy", {"x": ["x"], "y": ["y", "x"], "z": ["z"]}),
    ("hybrid_corexz", {"x": ["x"], "y": ["y"], "z": ["z", "x"]})])
def test_endstops_stop_all_motors_of_their_axis(make_bench, kind, stopped):
    def body(it):
        assert stops(it) == stopped
        kin = it.toolhead.get_kinematics()
        point = 30., 40., 50.
        found = kin.calc_position({rail.get_name(): rail.calc_position_from_coord(point)
                                   for rail in kin.rails})
        assert found == pytest.approx(point)
    make_bench(CARTESIAN.replace("kinematics: cartesian", "kinematics: " + kind)
               ).run_ready(body)


def test_without_axes(make_bench):
    def body(it):
        status = it.get("toolhead")
        assert status["homed_axes"] == "" and status["axis_maximum"] == (0.,) * 4
        it.send("G28\nG1 X5 F6000\nM84")
        assert it.toolhead.get_position()[0] == 5.
        kin = it.toolhead.get_kinematics()
        assert kin.get_steppers() == [] and kin.calc_position({}) == [0., 0., 0.]
    make_bench(NONE).run_ready(body)


def test_unknown_kind(make_bench):
    def body(it):
        assert "no kinematics 'cartesien'" in it.printer.state_message
    make_bench(CARTESIAN.replace("kinematics: cartesian", "kinematics: cartesien")
               ).run(body)
