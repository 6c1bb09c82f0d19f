# SPDX-License-Identifier: GPL-3.0-or-later
"""Deltas against what their geometry says, and on the simulated machine."""

import math
import pathlib
import random

import motion_bench
import pytest

from klippy.errors import CommandError
from klippy.kinematics.delta import Tower
from klippy.kinematics.delta_calibration import list_free
from klippy.lookahead import MotionLimits, Move

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "config" / "sample-delta.cfg"
GENERAL = MotionLimits(300., 3000., 0.5, 5.)
ARM, RADIUS, TOP = 333., 174.75, 297.05


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(**changes):
        config = SAMPLE.read_text()
        for section, lines in changes.items():
            config = config.replace("[%s]\n" % section, "[%s]\n%s\n" % (section, lines))
        return motion_bench.MotionBench(tmp_path, monkeypatch, config)
    return make


def check(kin, start, end, speed=100.):
    move = Move(GENERAL, (*start, 0.), (*end, 0.), speed)
    kin.check_move(move)
    return move


def test_highest_carriage_of_a_move():
    rng = random.Random(4)
    tower = Tower(100., 30., 300. ** 2, 400.)
    for _ in range(50):
        start, end = ([rng.uniform(-80., 80.), rng.uniform(-80., 80.),
                       rng.uniform(0., 100.)] for _ in range(2))
        move = Move(GENERAL, (*start, 0.), (*end, 0.), 100.)
        # nothing on the way is higher, and something comes near
        heights = [tower.calc_carriage(*(a + (b - a) * i / 400.
                                         for a, b in zip(start, end, strict=True)))
                   for i in range(401)]
        found = tower.find_highest(move)
        assert max(heights) <= found + 1e-9
        assert found - max(heights) < 0.01


def test_positions_and_room(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        assert kin.home_position == pytest.approx([0., 0., TOP], abs=1e-9)
        lift = math.sqrt(ARM ** 2 - RADIUS ** 2)
        for point in ((0., 0., 0.), (60., -40., 10.), (-100., 90., 120.)):
            positions = {}
            for name, angle in (("a", 210.), ("b", 330.), ("c", 90.)):
                x = RADIUS * math.cos(math.radians(angle)) - point[0]
                y = RADIUS * math.sin(math.radians(angle)) - point[1]
                positions["stepper_" + name] = (
                    point[2] + math.sqrt(ARM ** 2 - x * x - y * y))
            assert kin.calc_position(positions) == pytest.approx(point, abs=1e-9)
            for rail in kin.rails:
                assert rail.calc_position_from_coord(point) == pytest.approx(
                    positions[rail.get_name()])
        status = it.get("toolhead")
        assert status["cone_start_z"] == pytest.approx(TOP + lift - ARM)
        reach = 12. * ARM / math.sqrt(145.) - RADIUS
        assert status["axis_maximum"] == pytest.approx((reach, reach, TOP, 0.))
        assert status["axis_minimum"] == pytest.approx((-reach, -reach, -2., 0.))
        with pytest.raises(CommandError, match="No head is held by carriages"):
            kin.calc_point([0., 0., 1000.])
    make_bench().run_ready(body)


def test_moves_within_and_beyond(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        with pytest.raises(CommandError, match="Must home axis first"):
            check(kin, (0., 0., 5.), (10., 0., 5.))
        it.send("G28")
        assert it.get("toolhead")["homed_axes"] == "xyz"
        check(kin, (0., 0., 5.), (100., 0., 5.))
        for end, words in (
                ((121., 0., 5.), r"121.000 from the center is more than 120.000"),
                ((0., 0., -2.1), r"Z -2.100 is below -2.000"),
                ((0., 0., TOP + 0.01), r"the carriage of stepper_a would go 0.010 mm"),
                # high up and close to the tower of c
                ((0., 100., 270.), r"the carriage of stepper_c would go")):
            with pytest.raises(CommandError, match="Move out of range: .*" + words):
                check(kin, (0., 0., 5.), end)
        check(kin, (0., 0., 200.), (0., 0., TOP))
        # between two allowed points the way leads past the tower of c
        with pytest.raises(CommandError, match="carriage of stepper_c"):
            check(kin, (-90., 75., 270.), (90., 75., 270.))
        kin.clear_homing_state("z")
        assert it.get("toolhead")["homed_axes"] == ""
    make_bench(printer="print_radius: 120").run_ready(body)


def test_moves_are_slow_where_carriages_are_fast(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        kin.set_position((0., 0., 0.), "xyz")
        assert check(kin, (0., 0., 5.), (100., 0., 5.), 300.).max_cruise_v2 == 300. ** 2
        for ends in (((0., 0., 5.), (0., -150., 5.)), ((0., -150., 5.), (0., 0., 5.))):
            move = check(kin, *ends, 300.)
            # the carriage of c at the outer end of the way
            away = RADIUS + 150.
            ratio = away / math.sqrt(ARM ** 2 - away ** 2)
            assert math.sqrt(move.max_cruise_v2) * ratio == pytest.approx(900.)
            assert move.accel * ratio == pytest.approx(9000.)
        move = check(kin, (0., 0., 5.), (3., 0., 9.), 300.)
        assert move.max_cruise_v2 == pytest.approx((150. * 5. / 4.) ** 2)
    make_bench().run_ready(body)


def test_towers_of_their_own(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        arms = [math.sqrt(tower.arm2) for tower in kin.towers]
        assert arms == pytest.approx([333., 334., 333.])
        assert kin.towers[2].x == pytest.approx(RADIUS * math.cos(math.radians(91.)))
        ends = [rail.get_homing_info().position_endstop for rail in kin.rails]
        assert ends == [TOP, TOP, 298.]
        assert kin.max_z == TOP and kin.home_position[2] > TOP
        it.send("G28")
        it.send("G1 Z50 F3000\nG1 X-60 Y35")
        assert max(it.get_error()) < 0.03
    make_bench(stepper_b="arm_length: 334", stepper_c="angle: 91\nposition_endstop: 298"
               ).run_ready(body)


def test_calibration(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        found = kin.get_calibration()
        assert found.radius == RADIUS and found.angles == pytest.approx(
            (210., 330., 91.))
        assert found.arms == pytest.approx((ARM, 334., ARM))
        it.send("G28\nG1 X30 Y-20 Z10 F6000\nM400")
        point = it.toolhead.get_position()[:3]
        steps = found.find_steps(point)
        for motor, tower, count in zip(kin.get_steppers(), kin.towers, steps,
                                       strict=True):
            below = (tower.top - motor.get_commanded_position()) / 0.0125
            assert count == pytest.approx(below, abs=0.51)
        assert found.find_point(steps) == pytest.approx(point)
        parameters = found.get_parameters()
        assert found.replace_parameters(parameters) == found
        parameters["endstop_b"] += 1.
        assert found.replace_parameters(parameters).find_point(steps)[2] != point[2]
        assert set(list_free(True)) <= set(parameters)
        assert ("stepper_c", "angle", "91.000000") in found.list_options()
    make_bench(stepper_b="arm_length: 334", stepper_c="angle: 91").run_ready(body)


@pytest.mark.parametrize("section, lines, words", [
    ("printer", "print_radius: 0", "'0' must be above 0"),
    ("stepper_b", "arm_length: 170", "'170' must be above 174.75"),
    ("stepper_c", "position_endstop: -5", "minimum_z_position"),
])
def test_wrong_options(make_bench, section, lines, words):
    def body(it):
        assert it.printer.state == "error"
        assert words in it.printer.state_message, it.printer.state_message
    make_bench(**{section: lines}).run(body)
