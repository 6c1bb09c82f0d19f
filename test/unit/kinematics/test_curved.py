# SPDX-License-Identifier: GPL-3.0-or-later
"""Polar machines, deltesians, rotary deltas and winches: room, speed, errors."""

import math
import pathlib

import motion_bench
import pytest

from klippy.errors import CommandError
from klippy.kinematics.winch import calc_height
from klippy.lookahead import MotionLimits, Move

CONFIG = pathlib.Path(__file__).resolve().parents[3] / "config"
GENERAL = MotionLimits(200., 2000., 0.5, 5.)
CORE = 0.01


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(kind, edits=(), **changes):
        config = (CONFIG / ("sample-%s.cfg" % kind)).read_text()
        for before, after in edits:
            assert before in config
            config = config.replace(before, after, 1)
        for section, lines in changes.items():
            config = config.replace("[%s]\n" % section, "[%s]\n%s\n" % (section, lines))
        return motion_bench.MotionBench(tmp_path, monkeypatch, config)
    return make


def check(kin, start, end, speed=100.):
    """The move, if the kinematics let it pass in one part."""
    move = Move(GENERAL, (*start, 0.), (*end, 0.), speed)
    assert not kin.check_move(move)
    return move


def refuse(kin, end, words, start=(10., 10., 5.)):
    with pytest.raises(CommandError, match=words):
        kin.check_move(Move(GENERAL, (*start, 0.), (*end, 0.), 100.))


def get_speed(move):
    return math.sqrt(move.max_cruise_v2)


@pytest.mark.parametrize("kind, point", [
    ("polar", (-30., 40., 5.)), ("polar", (10., -20., 0.)),
    ("deltesian", (-70., 40., 9.)), ("deltesian", (90., 0., 80.)),
    ("rotary_delta", (0., 0., 0.)), ("rotary_delta", (-70., 60., 50.)),
    ("winch", (100., -300., 40.)), ("winch", (-10., 5., -150.))])
def test_positions_there_and_back(make_bench, kind, point):
    def body(it):
        kin = it.toolhead.get_kinematics()
        assert kin.calc_position({
            s.get_name(): s.calc_position_from_coord(point)
            for s in kin.get_steppers()}) == pytest.approx(point, abs=1e-9)
    make_bench(kind).run_ready(body)


# Polar


def test_polar_room(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        refuse(kin, (20., 10., 5.), "Must home axis first.*X is not homed")
        it.send("G28 Y")
        assert it.get("toolhead")["homed_axes"] == "xy"
        it.send("G28 Z")
        status = it.get("toolhead")
        assert status["axis_minimum"] == (-150., -150., 0., 0.)
        assert status["axis_maximum"] == (150., 150., 200., 0.)
        refuse(kin, (110., 110., 5.), "155.563 from the center is more than 150.000")
        refuse(kin, (60., 60., 201.), "Z 201.000 is not within")
        refuse(kin, (-30., -10., 5.), "it leads to 1.374 from the center, nearer than",
               (40., 10., 5.))
        kin.clear_homing_state("y")
        assert it.get("toolhead")["homed_axes"] == "z"
    text = "position_min: 20"
    make_bench("polar", stepper_arm=text).run_ready(body)


def test_polar_bed_keeps_its_speed(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        kin.set_position((50., 0., 5.), "xyz")
        assert get_speed(check(kin, (50., 10., 5.), (50., -9., 5.))) == 100.
        # 10 rad/s at 8 mm
        assert get_speed(check(kin, (8., 1., 5.), (8., -1., 5.))) == 80.
        assert get_speed(check(kin, (CORE, 0., 5.), (0., 0., 5.))) == pytest.approx(
            CORE * 10. / math.pi)
        move = Move(GENERAL, (30., 1., 5., 0.), (-30., 1., 5., 0.), 100.)
        assert kin.check_move(move) == 1
        cuts = kin.list_cuts(move)
        radii = [math.hypot(30. - 60. * share, 1.) for share in cuts]
        assert cuts == sorted(cuts) and radii[0] == pytest.approx(10.)
        assert radii == pytest.approx(radii[::-1])
        places = [(30. - 60. * share, 1., 5.) for share in (0., *cuts, 1.)]
        speeds = [get_speed(check(kin, a, b))
                  for a, b in zip(places, places[1:], strict=False)]
        assert speeds[0] == speeds[-1] == 100. and min(speeds) == pytest.approx(10.)
    make_bench("polar", printer="max_angular_velocity: 10").run_ready(body)


def test_polar_through_the_centre(make_bench):
    def body(it):
        it.send("G28\nG1 X40 Y20 Z5 F6000\nG1 X-40 Y-20 F12000\nG1 X0 Y0\nM400")
        it.machine.record_steps(True)
        it.send("G1 X0 Y30 F12000\nG1 X0 Y-30\nM400")
        it.pause(0.5)
        assert max(it.get_error()) < 0.02
        clocks = it.machine.take_steps()["stepper_bed"][:, 0]
        # never more than 50000 steps a second, as the default says
        assert len(clocks) > 5000
        freq = it.machine.mcus["mcu"].freq
        assert (clocks[50:] - clocks[:-50]).min() / freq > 0.9 * 50 / 50000.
    make_bench("polar").run_ready(body)


# Deltesian


def test_deltesian_room(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        it.send("G28 X")
        assert it.get("toolhead")["homed_axes"] == "xz"
        it.send("G28 Y")
        status = it.get("toolhead")
        assert status["axis_minimum"] == (-100., 0., 0., 0.)
        assert status["axis_maximum"] == (100., 200., 230., 0.)
        refuse(kin, (101., 10., 5.), "X 101.000 is not within -100.000 to 100.000")
        refuse(kin, (90., 10., 229.), "the carriage of stepper_right would go")
        check(kin, (0., 0., 5.), (0., 10., 230.))
        kin.clear_homing_state("x")
        assert it.get("toolhead")["homed_axes"] == "y"
    make_bench("deltesian").run_ready(body)


def test_deltesian_is_slow_where_arms_are_flat(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        kin.set_position((0., 0., 5.), "xyz")

        def reach(ratio):
            # way of the far carriage for a way of the head
            return 260. * ratio / math.sqrt(1. + ratio * ratio) - 150.
        low, high = it.get("toolhead")["axis_minimum"][0], reach(1. / math.tan(
            math.radians(5.)))
        assert high == pytest.approx(-low)
        for ratio, speed in ((2.9, 300.), (3.1, 150.), (5.9, 150.), (6.1, 75.)):
            move = check(kin, (0., 0., 5.), (reach(ratio), 0., 5.), 300.)
            assert get_speed(move) == pytest.approx(min(speed, 200.))
            assert move.accel == pytest.approx(min(speed * 10., 2000.))
        assert get_speed(check(kin, (108., 0., 5.), (108., 9., 5.), 300.)) == 200.
    make_bench("deltesian", [("print_width: 200\n", "")]).run_ready(body)


@pytest.mark.parametrize("section, lines, words", [
    ("printer", "min_angle: 70", "x can only be 61.075 to -61.075, which is no room"),
    ("printer", "minimum_z_position: 231", "must be at most 230"),
    ("stepper_right", "arm_length: 140", "'140' must be above 150"),
])
def test_deltesian_errors(make_bench, section, lines, words):
    def body(it):
        assert it.printer.state == "error"
        assert words in it.printer.state_message, it.printer.state_message
    make_bench("deltesian", **{section: lines}).run(body)


# Rotary delta


def test_rotary_delta_room(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        refuse(kin, (20., 10., 5.), "Must home axis first.*no axis is homed")
        it.send("G28 Z")
        status = it.get("toolhead")
        assert status["homed_axes"] == "xyz" and status["axis_maximum"][2] == 200.
        edge = status["axis_maximum"][0]
        assert kin.find_ratio(-edge * math.cos(math.radians(30.)),
                              -edge * math.sin(math.radians(30.)), 0.) <= 12.
        refuse(kin, (edge + 1., 0., 5.), "from the center is more than")
        refuse(kin, (0., 0., -1.), "Z -1.000 is below 0.000")
        for end in ((0., 0., 201.), (70., 0., 195.)):
            refuse(kin, end, "the arm of stepper_a would swing past its endstop")
    make_bench("rotary_delta").run_ready(body)


def test_rotary_delta_ratio_is_the_speed_of_an_elbow(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        kin.set_position((0., 0., 5.), "xyz")
        edge = it.get("toolhead")["axis_maximum"][0]
        rim = max(((edge * math.cos(0.1 * i), edge * math.sin(0.1 * i), 0.)
                   for i in range(63)), key=lambda point: kin.find_ratio(*point))
        for point in ((0., 0., 5.), (50., -60., 30.), rim):
            found = 0.
            for motor in kin.get_steppers():
                at = motor.calc_position_from_coord(point)
                slopes = [(motor.calc_position_from_coord(
                    [v + 1e-5 * (i == j) for j, v in enumerate(point)]) - at) / 1e-5
                    for i in range(3)]
                found = max(found, 160. * math.hypot(*slopes))
            assert kin.find_ratio(*point) == pytest.approx(found, rel=1e-2)
        ratio = kin.find_ratio(*rim)
        assert ratio > 3.
        move = check(kin, (0., 0., 0.), [0.999 * v for v in rim], 300.)
        ratio = kin.find_ratio(*move.end_pos[:3])
        assert get_speed(move) == pytest.approx(200. * 3. / ratio)
    make_bench("rotary_delta").run_ready(body)


@pytest.mark.parametrize("section, lines, words", [
    ("printer", "minimum_z_position: -100", "the arms do not reach the middle at"),
    ("stepper_b", "position_endstop: 1000", "the arm does not reach the middle at"),
    ("stepper_c", "lower_arm_length: -1", "'-1' must be above 0"),
])
def test_rotary_delta_errors(make_bench, section, lines, words):
    def body(it):
        assert it.printer.state == "error"
        assert words in it.printer.state_message, it.printer.state_message
    make_bench("rotary_delta", **{section: lines}).run(body)


# Winch


def test_winch(make_bench):
    def body(it):
        kin = it.toolhead.get_kinematics()
        it.send("G1 X30 Y20 F6000\nG1 X0 Y0\nG28")
        status = it.get("toolhead")
        assert status["homed_axes"] == "xyz"
        assert status["axis_minimum"] == (-1800., -2000., -100., 0.)
        assert status["axis_maximum"] == (1800., 1000., 2500., 0.)
        with pytest.raises(CommandError, match="No head is held by cables of 1.000"):
            kin.calc_position({"stepper_" + letter: 1. for letter in "abcd"})
    make_bench("winch").run_ready(body)


def test_winches_in_a_line(make_bench):
    assert calc_height((0., 0., 0.), (3., 4., 0.), (6., 8., 0.)) == 0.
    assert calc_height((0., 0., 0.), (10., 0., 0.), (5., 0., 2.)) == pytest.approx(2.)

    def body(it):
        assert "stepper_a, stepper_b and stepper_c are in one line" in (
            it.printer.state_message)
    make_bench("winch", [
        ("anchor_x: 1800", "anchor_x: 0"), ("anchor_x: -1800", "anchor_x: 0"),
        ("anchor_y: 1000", "anchor_y: 500")]).run(body)
