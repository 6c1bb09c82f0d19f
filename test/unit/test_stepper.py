# SPDX-License-Identifier: GPL-3.0-or-later
"""Steppers and rails of printers on the simulated machine, with real firmware."""

import math
import pathlib
import re
import sys
import types

import pytest

from klippy import chelper, stepper
from klippy import printer as printer_module
from klippy.errors import ConfigError
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.trapq import TrapQ

UNIT = pathlib.Path(__file__).resolve().parent
for folder in (UNIT / "simulator", UNIT / "extras" / "home"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

import motion_bench  # noqa: E402
from motion_bench import CARTESIAN  # noqa: E402

SECOND_Z = """
[stepper_z1]
step_pin: PC1
dir_pin: PC0
enable_pin: !PC2
microsteps: 16
rotation_distance: 8
"""


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(config=CARTESIAN, hook=None):
        bench = motion_bench.MotionBench(tmp_path, monkeypatch, config)
        if hook is not None:
            module = types.SimpleNamespace(add_printer_objects=hook)
            monkeypatch.setattr(printer_module, "LAST_MODULES",
                                (*printer_module.LAST_MODULES, module))
        return bench
    return make


@pytest.fixture
def get_message(make_bench):
    """The message of a printer that does not start with a config."""
    def get_message(config):
        messages = []

        def body(it):
            assert it.printer.state == "error"
            messages.append(it.printer.state_message)
        make_bench(config).run(body)
        return messages[0]
    return get_message


def rails_of(it):
    return it.toolhead.get_kinematics().rails


def motor_of(it, axis):
    return rails_of(it)["xyz".index(axis)].get_steppers()[0]


def change(old, new, config=CARTESIAN):
    assert old in config
    return config.replace(old, new, 1)


# Counts and positions


def test_counts_are_those_of_the_motors(make_bench):
    def body(it):
        it.send("G28\nG1 X33.3 Y100.01 Z7 F6000\nG1 X4")
        it.toolhead.wait_moves()
        it.toolhead.flush_step_generation()
        it.pause(0.1)
        counts = it.machine.get_step_counts()
        for rail in rails_of(it):
            motor = rail.get_steppers()[0]
            steps = motor.get_mcu_position()
            assert steps == counts[motor.get_name()]
            commanded = motor.get_commanded_position()
            assert motor.mcu_to_commanded_position(steps) == commanded
            assert motor.get_mcu_position(commanded + 10.2 * motor.get_step_dist()) \
                == steps + 10
            assert motor.get_mcu_position(commanded - 0.4 * motor.get_step_dist()) \
                == steps
            assert motor.calc_position_from_coord(it.toolhead.get_position()) \
                == pytest.approx(commanded, abs=motor.get_step_dist())
    make_bench().run_ready(body)


def test_past_positions_are_those_of_their_time(make_bench):
    def body(it):
        it.send("G28")
        it.toolhead.wait_moves()
        motor = motor_of(it, "x")
        start = motor.get_mcu_position()
        begin = it.toolhead.get_last_move_time()
        it.send("G1 X100 F6000")
        end = it.toolhead.get_last_move_time()
        it.toolhead.wait_moves()
        it.toolhead.flush_step_generation()
        assert motor.get_past_mcu_position(begin) == start
        # symmetric: half the way at half the time, to the step
        middle = motor.get_past_mcu_position((begin + end) / 2.)
        assert abs(middle - start - 4000) <= 1
        assert motor.get_past_mcu_position(end + 0.001) == start + 8000
        clock = motor.get_mcu().print_time_to_clock
        runs, count = motor.dump_steps(1000, clock(begin), clock(end))
        assert count == len(runs) and sum(run[3] for run in runs) == 8000
    make_bench().run_ready(body)


def test_host_restart_takes_the_counts_over(make_bench):
    bench = make_bench()

    def before(it):
        it.send("G28 X\nG1 X20 F6000")
        it.toolhead.wait_moves()
        it.pause(0.2)

    def after(it):
        counts = it.machine.get_step_counts()
        assert counts["stepper_x"] not in (0, 1600)
        for axis in "xyz":
            motor = motor_of(it, axis)
            assert motor.get_mcu_position() == counts[motor.get_name()]
        it.send("G28\nG1 X30 F6000")
        assert max(it.get_error()) <= 0.0125

    bench.run_ready(before)
    bench.run_ready(after)


def test_set_position_moves_nothing(make_bench):
    def body(it):
        it.send("G28 X")
        motor = motor_of(it, "x")
        it.toolhead.flush_step_generation()
        steps = motor.get_mcu_position()
        it.toolhead.set_position([77.7, 0., 0., 0.])
        assert motor.get_commanded_position() == 77.7
        assert motor.get_mcu_position() == steps
        assert motor.mcu_to_commanded_position(steps + 80) == pytest.approx(78.7)
    make_bench().run_ready(body)


def test_rotation_distance_and_direction_may_change(make_bench):
    def body(it):
        events = []
        it.printer.register_event_handler("stepper:set_dir_inverted", events.append)
        it.send("G28 X\nG1 X10 F6000")
        it.toolhead.flush_step_generation()
        motor = motor_of(it, "x")
        commanded, steps = motor.get_commanded_position(), motor.get_mcu_position()
        motor.set_rotation_distance(80.)
        assert motor.get_rotation_distance() == (80., 3200.)
        assert motor.get_commanded_position() == commanded
        assert motor.get_mcu_position() == steps

        def count(script):
            it.toolhead.wait_moves()
            it.pause(0.1)
            before = it.machine.get_step_counts()["stepper_x"]
            it.send(script)
            it.toolhead.wait_moves()
            it.pause(0.1)
            return it.machine.get_step_counts()["stepper_x"] - before
        assert count("G1 X20") == 400
        assert motor.get_dir_inverted() == (0, 0)
        it.toolhead.flush_step_generation()
        motor.set_dir_inverted(True)
        motor.set_dir_inverted(1)
        assert motor.get_dir_inverted() == (1, 0) and events == [motor]
        assert count("G1 X30") == -400
    make_bench().run_ready(body)


# Kinematics


def test_kinematics_by_historical_names():
    coord = 3., 5., 7.
    for kind, variant, position in (
            ("cartesian_stepper_alloc", b"x", 3.), ("cartesian_stepper_alloc", "z", 7.),
            ("corexy_stepper_alloc", b"+", 8.), ("corexy_stepper_alloc", b"-", -2.),
            ("corexz_stepper_alloc", b"-", -4.)):
        made = stepper.make_kinematics(kind, variant)
        assert made.calc_position_from_coord(*coord) == position
    delta = stepper.make_kinematics("delta_stepper_alloc", 400., 0., 10.)
    assert delta.calc_position_from_coord(0., 10., 5.) == pytest.approx(25.)
    arm = stepper.make_kinematics("polar_stepper_alloc", b"r")
    assert arm.calc_position_from_coord(3., 4., 9.) == 5.
    bed = stepper.make_kinematics("polar_stepper_alloc", b"a")
    assert bed.calc_position_from_coord(0., 4., 9.) == pytest.approx(math.pi / 2.)
    winch = stepper.make_kinematics("winch_stepper_alloc", 0., 0., 9.)
    assert winch.calc_position_from_coord(3., 4., 9.) == 5.
    left = stepper.make_kinematics("deltesian_stepper_alloc", 25., -3.)
    assert left.calc_position_from_coord(0., 7., 1.) == 5.
    elbow = stepper.make_kinematics("rotary_delta_stepper_alloc", 10., 50., 0., 20.,
                                    50.)
    assert elbow.calc_position_from_coord(0., 0., 10.) == pytest.approx(0.)
    extruder = stepper.make_kinematics("extruder_stepper_alloc")
    assert extruder.calc_position_from_coord(*coord) == 3.
    with pytest.raises(ConfigError, match="no kinematics 'polar'.*corexy"):
        stepper.make_kinematics("polar", 1)
    with pytest.raises(ConfigError, match="have no 'w', only x, y, z"):
        stepper.make_kinematics("cartesian_stepper_alloc", b"w")


def test_kinematics_and_queues_may_be_exchanged(make_bench):
    def body(it):
        it.send("G28 X")
        it.toolhead.flush_step_generation()
        motor = motor_of(it, "x")
        steps = motor.get_mcu_position()
        other, queue = LinearKinematics(0., 1., 0.), TrapQ()
        old = motor.set_stepper_kinematics(other)
        assert isinstance(old, LinearKinematics)
        assert motor.get_stepper_kinematics() is motor.kinematics is other
        assert not motor.is_active_axis("x") and motor.is_active_axis("y")
        assert other.trapq is it.toolhead.get_trapq()
        assert motor.set_trapq(queue) is it.toolhead.get_trapq()
        assert motor.get_trapq() is queue and other.trapq is queue
        motor.set_position((0., 4., 0.))
        assert motor.get_commanded_position() == 4.
        assert motor.get_mcu_position() == steps
        assert motor.set_stepper_kinematics(old) is other
        assert motor.set_trapq(it.toolhead.get_trapq()) is queue
        assert motor.get_commanded_position() == old.get_commanded_pos()
        it.send("G1 X10 F6000")
        assert it.get_error()[0] <= 0.0125
        # new ones do not repeat what is past
        it.toolhead.flush_step_generation()
        motor.set_stepper_kinematics(LinearKinematics(1., 0., 0.))
        motor.set_position(it.toolhead.get_position())
        it.send("G1 X20")
        assert it.get_error()[0] <= 0.0125
    make_bench().run_ready(body)


def test_pointers_of_plug_ins_may_be_used(make_bench):
    def body(it):
        ffi, lib = chelper.get_ffi()
        pointer = ffi.gc(lib.cartesian_stepper_alloc(b"y"), lib.free)
        queue = ffi.gc(lib.trapq_alloc(), lib.trapq_free)
        motor = motor_of(it, "x")
        old = motor.set_stepper_kinematics(pointer)
        old_queue = motor.set_trapq(queue)
        assert motor.get_stepper_kinematics() is pointer
        assert motor.get_trapq() is queue
        assert motor.calc_position_from_coord((1., 2., 3.)) == 2.
        assert motor.set_trapq(old_queue) is queue
        assert motor.set_stepper_kinematics(old) is pointer
    make_bench().run_ready(body)


# Step pulses


def list_config(it):
    return [cmd for cmd in it.printer.lookup_object("mcu")._config.config_cmds
            if cmd.startswith("config_stepper")]


def test_pulses_without_a_wish(make_bench):
    def body(it):
        freq = it.printer.lookup_object("mcu").get_constant_float("CLOCK_FREQ")
        assert motor_of(it, "x").get_pulse_duration() == (0.000002, False)
        for cmd in list_config(it):
            assert "invert_step=0" in cmd
            assert "step_pulse_ticks=%d" % (0.000002 * freq,) in cmd
    make_bench().run_ready(body)


@pytest.mark.parametrize("pulse", [0.0000001, 0.0000004])
def test_drivers_may_step_on_both_edges(make_bench, pulse):
    def hook(config):
        lookup = config.get_printer().lookup_object("force_move").lookup_stepper
        for name in ("stepper_x", "stepper_y", "stepper_z"):
            lookup(name).setup_default_pulse_duration(pulse, True)

    def body(it):
        durations = {axis: motor_of(it, axis).get_pulse_duration() for axis in "xyz"}
        assert durations == {"x": (pulse, True), "y": (0.000005, True),
                             "z": (pulse, True)}
        inverts = [cmd.partition("invert_step=")[2].split()[0]
                   for cmd in list_config(it)]
        assert inverts == ["-1", "0", "-1"]
        it.send("G28\nG1 X50 Y20 Z9 F6000")
        assert max(it.get_error()) <= 0.0125
        assert it.machine.get_total_steps()["stepper_x"] > 4000

    config = change("[stepper_y]", "[stepper_y]\nstep_pulse_duration: 0.000005")
    make_bench(config, hook).run_ready(body)


# Options


def test_gears(make_bench):
    def body(it):
        motor = motor_of(it, "x")
        assert motor.get_rotation_distance() == (40., 400 * 16 * 6.)
        assert motor.get_step_dist() == pytest.approx(40. / (400 * 16 * 6))
        assert not motor.units_in_radians()
        assert motor.get_name() == "stepper_x" and motor.get_name(True) == "x"
    config = change("[stepper_x]", "[stepper_x]\nfull_steps_per_rotation: 400\n"
                    "gear_ratio: 3:1, 80:40")
    make_bench(config).run_ready(body)


class Options:
    """What parse_step_distance() asks of a section."""

    error = ConfigError

    def __init__(self, **options):
        self.options = options

    def get_name(self):
        return "stepper_x"

    def get(self, option, default=KeyError, note_valid=True):
        if default is KeyError:
            return self.options[option]
        return self.options.get(option, default)

    def getfloat(self, option, above, note_valid):
        return self.options[option]

    def getint(self, option, default=None, minval=0, note_valid=True):
        return self.options.get(option, default)

    def getlists(self, option, default, seps, count, parser, note_valid):
        return self.options.get(option, default)


def test_axes_with_gears_only_are_angles():
    distance, steps = stepper.parse_step_distance(
        Options(gear_ratio=[(107., 16.)], microsteps=16))
    assert distance == pytest.approx(2. * math.pi)
    assert steps == pytest.approx(200 * 16 * 107. / 16.)
    assert stepper.parse_step_distance(Options(
        gear_ratio=[(3., 1.)], rotation_distance=8., microsteps=1)) == (8., 600.)


def test_gears_have_teeth():
    with pytest.raises(ConfigError, match="'0:1' must be two numbers above 0"):
        stepper.parse_gear_ratio(Options(gear_ratio=[(2., 1.), (0., 1.)]))


@pytest.mark.parametrize("old, new, words", [
    ("[stepper_x]", "[stepper_x]\nfull_steps_per_rotation: 201",
     "'201' must be a multiple of 4"),
    ("position_endstop: 0\n", "position_endstop: -1\n",
     "'position_endstop' in section 'stepper_x': -1.000 must be between"),
    ("position_endstop: 0\n", "position_endstop: 100\n",
     "'homing_positive_dir' in section 'stepper_x' is needed"),
    ("position_endstop: 0\n", "position_endstop: 0\nhoming_positive_dir: True\n",
     "'True' leads away from the endstop, which is at the lower end"),
    ("position_max: 200", "position_max: 0", "position_max.*above"),
])
def test_wrong_options_are_named(get_message, old, new, words):
    message = get_message(change(old, new))
    assert re.search(words, message), message


def test_direction_pin_of_another_mcu(get_message):
    config = change("dir_pin: PF1", "dir_pin: other:PF1") + (
        "[mcu other]\nserial: /dev/other\n")
    assert "must be on that of step_pin, 'mcu'" in get_message(config)


def test_homing_options(make_bench):
    def body(it):
        x, y, z = rails_of(it)
        assert x.get_homing_info() == stepper.HomingInfo(
            speed=50., position_endstop=0., retract_speed=50., retract_dist=5.,
            positive_dir=False, second_homing_speed=25., min_home_dist=5.)
        assert y.get_homing_info().positive_dir
        assert z.get_homing_info()[1:4] == (0.5, 33., 0.)
        assert z.get_homing_info().second_homing_speed == 3.
        assert x.get_range() == (0., 200.) and z.get_range() == (-2., 200.)
        assert (x.get_name(), x.get_name(True)) == ("stepper_x", "x")
    config = change("position_endstop: 0.5", "position_endstop: 0.5\nposition_min: -2\n"
                    "second_homing_speed: 3\nhoming_retract_speed: 33\n"
                    "homing_retract_dist: 0")
    make_bench(config).run_ready(body)


# Rails of several motors


def endstop_names(rail):
    return [name for _, name in rail.get_endstops()]


def test_motors_may_share_the_endstop(make_bench):
    def body(it):
        rail = rails_of(it)[2]
        names = [motor.get_name() for motor in rail.get_steppers()]
        assert names == ["stepper_z", "stepper_z1"]
        assert endstop_names(rail) == ["z"]
        assert rail.get_endstops()[0][0].get_steppers() == rail.get_steppers()
        it.send("G28\nG1 Z20 F600")
        assert max(it.get_error()) <= 0.0125
        counts = it.machine.get_step_counts()
        assert counts["stepper_z"] == counts["stepper_z1"]
    make_bench(CARTESIAN + SECOND_Z).run_ready(body)


def test_the_same_pin_named_again_is_the_same_endstop(make_bench):
    def body(it):
        assert endstop_names(rails_of(it)[2]) == ["z"]
    make_bench(CARTESIAN + SECOND_Z + "endstop_pin: ^PD3\n").run_ready(body)


def test_a_motor_may_have_its_own_endstop(make_bench):
    def body(it):
        rail = rails_of(it)[2]
        assert endstop_names(rail) == ["z", "z1"]
        assert [[s.get_name() for s in e.get_steppers()]
                for e, _ in rail.get_endstops()] == [["stepper_z"], ["stepper_z1"]]
        it.send("QUERY_ENDSTOPS")
        assert it.output[-1] == "x:open y:open z:open z1:open"
        it.send("G28")
        assert max(it.get_error()) <= 0.0125
    make_bench(CARTESIAN + SECOND_Z + "endstop_pin: ^PC5\n").run_ready(body)


def test_a_shared_endstop_is_written_one_way(get_message):
    message = get_message(CARTESIAN + SECOND_Z + "endstop_pin: ^!PD3\n")
    assert "shared by steppers of 'stepper_z'" in message


def test_rails_of_plug_ins():
    assert issubclass(stepper.PrinterRail, stepper.GenericPrinterRail)
    assert stepper.PrinterRail.make_stepper is stepper.PrinterStepper
