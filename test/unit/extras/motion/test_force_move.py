# SPDX-License-Identifier: GPL-3.0-or-later
import math

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError, ConfigError
from klippy.extras import force_move

FORCED = CARTESIAN + "[force_move]\nenable_force_move: True\n"


@pytest.fixture
def run(tmp_path, monkeypatch):
    def run(body, config=FORCED):
        motion_bench.MotionBench(tmp_path, monkeypatch, config).run_ready(body)
    return run


def settle(it):
    it.toolhead.wait_moves()
    it.pause(0.3)


def count(it, name="stepper_x"):
    settle(it)
    return it.machine.get_step_counts()[name]


@pytest.mark.parametrize("dist, speed, accel", [
    (100., 50., 200.), (-100., 50., 200.), (1., 50., 200.), (-3., 20., 0.),
    (0.001, 5., 1000.)])
def test_times_of_a_move(dist, speed, accel):
    direction, accel_t, cruise_t, top = force_move.calc_move_time(dist, speed, accel)
    assert direction == math.copysign(1., dist)
    assert top <= speed and accel_t >= 0. and cruise_t >= -1e-12
    assert top * (accel_t + cruise_t) == pytest.approx(abs(dist))
    if accel:
        assert top == pytest.approx(accel * accel_t)
        assert cruise_t == pytest.approx(0., abs=1e-9) or top == speed


def test_no_way_takes_no_time():
    assert force_move.calc_move_time(0., 50., 200.)[1:3] == (0., 0.)


def test_forced_moves(run):
    def body(it):
        events, start = [], count(it)
        it.printer.register_event_handler("stepper_enable:motor_off", events.append)
        it.send("FORCE_MOVE STEPPER=stepper_x DISTANCE=10 VELOCITY=20")
        assert count(it) - start == 800
        it.send("FORCE_MOVE STEPPER=stepper_x DISTANCE=-2.5 VELOCITY=50 ACCEL=100")
        assert count(it) - start == 600
        # it is on, but not homed by that
        assert it.get("stepper_enable")["steppers"]["stepper_x"]
        assert it.get("toolhead")["homed_axes"] == "" and events == []
        motor = it.printer.lookup_object("force_move").lookup_stepper("stepper_x")
        assert motor.get_commanded_position() == 0.
        assert motor.get_mcu_position() == count(it)
        assert motor.get_trapq() is it.toolhead.get_trapq()
        it.send("G28 X\nG1 X15 F6000")
        assert it.get_error()[0] <= 0.0125
    run(body)


def test_forced_moves_take_their_time(run):
    def body(it):
        it.send("FORCE_MOVE STEPPER=stepper_z DISTANCE=1 VELOCITY=10")
        settle(it)
        begin = it.toolhead.get_last_move_time()
        it.send("FORCE_MOVE STEPPER=stepper_z DISTANCE=20 VELOCITY=10 ACCEL=20")
        # 20 mm at 10 mm/s, and half a second to get there
        assert it.toolhead.get_last_move_time() - begin == pytest.approx(2.5)
    run(body)


def test_head_stays_where_it_is_said_to_be(run):
    def body(it):
        it.send("G28\nG1 X50 Y50 Z5 F6000")
        position = it.toolhead.get_position()
        it.send("FORCE_MOVE STEPPER=stepper_y DISTANCE=4 VELOCITY=20")
        assert it.toolhead.get_position() == position
        it.send("G1 Y60")
        assert it.get_error() == pytest.approx([0., 4., 0.], abs=0.0126)
    run(body)


def test_buzz_goes_to_and_fro(run):
    def body(it):
        start, total = count(it), it.machine.get_total_steps()["stepper_x"]
        it.send("STEPPER_BUZZ STEPPER=stepper_x")
        assert count(it) == start
        assert it.machine.get_total_steps()["stepper_x"] - total == 10 * 2 * 80
        assert not it.get("stepper_enable")["steppers"]["stepper_x"]
        it.send("SET_STEPPER_ENABLE STEPPER=stepper_x\nSTEPPER_BUZZ STEPPER=stepper_x")
        assert it.get("stepper_enable")["steppers"]["stepper_x"]
    run(body, CARTESIAN)


def test_forced_moves_are_an_option(run):
    def body(it):
        commands = it.printer.lookup_object("gcode").get_command_help()
        assert "STEPPER_BUZZ" in commands
        assert not {"FORCE_MOVE", "SET_KINEMATIC_POSITION"} & set(commands)
        with pytest.raises(ConfigError, match="no stepper 'stepper_q'"):
            it.printer.lookup_object("force_move").lookup_stepper("stepper_q")
    run(body, CARTESIAN)


@pytest.mark.parametrize("line", [
    "FORCE_MOVE STEPPER=stepper_x DISTANCE=1 VELOCITY=0",
    "FORCE_MOVE STEPPER=stepper_x DISTANCE=1 VELOCITY=5 ACCEL=-1",
    "FORCE_MOVE STEPPER=stepper_x VELOCITY=5",
    "FORCE_MOVE STEPPER=stepper_q DISTANCE=1 VELOCITY=5", "STEPPER_BUZZ STEPPER=q"])
def test_wrong_parameters(run, line):
    def body(it):
        with pytest.raises(CommandError):
            it.send(line)
        assert count(it) == 0
    run(body)


def test_positions_may_be_declared(run):
    def body(it):
        def homed():
            return it.get("toolhead")["homed_axes"]
        it.send("SET_KINEMATIC_POSITION X=10 Y=20")
        assert it.toolhead.get_position() == [10., 20., 0., 0.] and homed() == "xyz"
        it.send("SET_KINEMATIC_POSITION Z=7 CLEAR_HOMED=XY")
        assert it.toolhead.get_position() == [10., 20., 7., 0.] and homed() == "z"
        it.send("SET_KINEMATIC_POSITION SET_HOMED=Y")
        assert homed() == "yz"
        it.send("SET_KINEMATIC_POSITION SET_HOMED= CLEAR=z")
        assert homed() == "y"
        it.send("SET_KINEMATIC_POSITION SET_HOMED= CLEAR_HOMED=xyz")
        assert homed() == ""
        it.send("SET_KINEMATIC_POSITION X=100 Y=100 Z=5")
        start = count(it)
        it.send("G1 X110 F6000")
        assert count(it) - start == 800
    run(body)
