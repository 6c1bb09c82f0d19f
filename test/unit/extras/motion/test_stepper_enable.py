# SPDX-License-Identifier: GPL-3.0-or-later
"""Enable lines on the simulated machine: levels at the pins."""

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError, ConfigError


@pytest.fixture
def run(tmp_path, monkeypatch):
    def run(body, config=CARTESIAN):
        motion_bench.MotionBench(tmp_path, monkeypatch, config).run_ready(body)
    return run


def watch(it, pin):
    """Function that tells whether an enable pin is active now."""
    ref = it.machine.pins.lookup(pin)
    trace = it.machine.mcus[ref.mcu].watch_output(ref.number, invert=ref.invert)
    return lambda: bool(trace.level)


def state(it):
    return it.get("stepper_enable")["steppers"]


def settle(it):
    it.toolhead.wait_moves()
    it.pause(0.3)


def test_motors_are_on_when_they_move(run):
    def body(it):
        x, y = watch(it, "!PD7"), watch(it, "!PF2")
        assert not x() and not y()
        assert state(it) == {"stepper_x": False, "stepper_y": False,
                             "stepper_z": False}
        trace = it.machine.traces["stepper_x"]
        it.send("SET_KINEMATIC_POSITION X=0 Y=0 Z=0\nG1 X50 F600")
        while not trace.total:
            assert not state(it)["stepper_y"]
            it.pause(0.001)
        # not one step before the driver is on
        assert x() and not y() and trace.total < 10
        settle(it)
        assert state(it) == {"stepper_x": True, "stepper_y": False,
                             "stepper_z": False}
        it.send("M84")
        settle(it)
        assert not x() and not any(state(it).values())
        it.send("SET_KINEMATIC_POSITION X=0\nG1 X5 F600")
        settle(it)
        assert x() and state(it)["stepper_x"]
    run(body, CARTESIAN + "[force_move]\nenable_force_move: True\n")


def test_off_comes_after_all_motion(run):
    def body(it):
        events, x = [], watch(it, "!PD7")
        it.printer.register_event_handler("stepper_enable:motor_off", events.append)
        it.send("G28 X\nG1 X100 F6000")
        end = it.toolhead.get_last_move_time()
        it.send("M18")
        assert len(events) == 1 and events[0] >= end
        mcu = it.printer.lookup_object("mcu")
        while mcu.estimated_print_time(it.world.monotonic()) < end:
            assert x()
            it.pause(0.010)
        settle(it)
        assert not x()
        assert it.machine.calc_position()[0] == pytest.approx(100., abs=0.0126)
        with pytest.raises(CommandError, match="Must home"):
            it.send("G1 X10")
    run(body)


def test_single_motors(run):
    def body(it):
        z = watch(it, "!PK0")
        it.send("SET_STEPPER_ENABLE STEPPER=stepper_z")
        settle(it)
        assert z() and state(it)["stepper_z"] and not state(it)["stepper_x"]
        it.send("SET_STEPPER_ENABLE STEPPER=stepper_z ENABLE=0")
        settle(it)
        assert not z() and not any(state(it).values())
        with pytest.raises(CommandError):
            it.send("SET_STEPPER_ENABLE STEPPER=stepper_q")
        it.send("G28 Z")
        assert z()
    run(body)


def test_motors_may_share_a_line(run):
    def body(it):
        line = watch(it, "!PD7")
        enable = it.printer.lookup_object("stepper_enable")
        assert not enable.lookup_enable("stepper_x").has_dedicated_enable()
        assert not enable.lookup_enable("stepper_y").has_dedicated_enable()
        assert enable.lookup_enable("stepper_z").has_dedicated_enable()
        for value, name, is_on in ((1, "x", True), (1, "y", True), (0, "x", True),
                                   (0, "y", False)):
            it.send("SET_STEPPER_ENABLE STEPPER=stepper_%s ENABLE=%d" % (name, value))
            settle(it)
            assert line() == is_on
    run(body, CARTESIAN.replace("enable_pin: !PF2", "enable_pin: !PD7"))


def test_motors_without_a_line(run):
    def body(it):
        enable = it.printer.lookup_object("stepper_enable").lookup_enable("stepper_x")
        assert not enable.has_dedicated_enable() and not enable.is_motor_enabled()
        it.send("G28 X")
        assert enable.is_motor_enabled()
    run(body, CARTESIAN.replace("enable_pin: !PD7", ""))


def test_callbacks_hear_of_changes_once(run):
    def body(it):
        calls = []
        module = it.printer.lookup_object("stepper_enable")
        module.lookup_enable("stepper_x").register_state_callback(
            lambda print_time, is_enabled: calls.append((print_time, is_enabled)))
        it.send("G28 X")
        for _ in range(3):
            module.set_motors_enable(["stepper_x"], True)
        assert [on for _, on in calls] == [True]
        it.send("M84\nM84")
        assert [on for _, on in calls] == [True, False]
        assert calls[0][0] < calls[1][0]
        for _ in range(3):
            module.set_motors_enable(["stepper_x"], True)
            module.set_motors_enable(["stepper_x"], False)
        # a motor awaits its motion once, however often it was switched
        motor = module.lookup_enable("stepper_x").stepper
        it.send("G28 X")
        assert [on for _, on in calls] == [True, False] * 4 + [True]
        motor.add_active_callback(lambda print_time: calls.append("moves"))
        it.send("G1 X20 F6000")
        settle(it)
        assert calls[9:] == ["moves"]
        assert module.get_steppers() == ["stepper_x", "stepper_y", "stepper_z"]
        with pytest.raises(ConfigError, match="no stepper 'stepper_q', only stepper_x"):
            module.lookup_enable("stepper_q")
    run(body)


def test_motors_are_off_for_a_restart(run):
    def body(it):
        x = watch(it, "!PD7")
        it.send("G28 X")
        assert x()
        it.printer.send_event("gcode:request_restart", 0.)
        settle(it)
        assert not x()
    run(body)
