# SPDX-License-Identifier: GPL-3.0-or-later
import itertools
import math
import random

import motion_machine
import pytest
from motion_machine import count

from klippy.errors import CommandError
from klippy.extras.manual_stepper import StopMode

ARM = """
[manual_stepper arm]
step_pin: PC0
dir_pin: PC1
enable_pin: !PC2
microsteps: 16
rotation_distance: 32
velocity: 20
accel: 200
endstop_pin: ^PC3
position_endstop: 0
"""
FREE = """
[manual_stepper free]
step_pin: PC4
dir_pin: PC5
microsteps: 16
rotation_distance: 32
position_min: -10
position_max: 50
"""
NAME = "manual_stepper arm"
STEP = 32. / 3200.
MOVE = "MANUAL_STEPPER STEPPER=arm "


@pytest.fixture
def run(tmp_path, monkeypatch):
    return motion_machine.make_run(tmp_path, monkeypatch)


def place(it):
    """mm of the arm, as its switch knows it."""
    return it.machine.axes.start[NAME] + count(it, NAME) * STEP


def spent(it, script):
    begin = it.toolhead.get_last_move_time()
    it.send(script)
    return it.toolhead.get_last_move_time() - begin


def position(it, name=NAME):
    return it.get(name)["position"]


def test_moves(run):
    def body(it):
        assert spent(it, MOVE + "MOVE=10") == pytest.approx(10. / 20. + 20. / 200.)
        assert count(it, NAME) == 1000 and position(it) == 10.
        assert spent(it, MOVE + "MOVE=4 SPEED=5 ACCEL=0") == pytest.approx(6. / 5.)
        assert count(it, NAME) == 400
        it.send(MOVE + "SET_POSITION=100 MOVE=101")
        assert count(it, NAME) == 500 and position(it) == 101.
        assert spent(it, MOVE + "MOVE=101") == 0.
        assert it.get("stepper_enable")["steppers"][NAME]
    run(body, ARM)


def test_default_speed_and_range(run):
    def body(it):
        assert spent(it, "MANUAL_STEPPER STEPPER=free MOVE=10") == pytest.approx(2.)
        for goal in ("-10.1", "50.1"):
            with pytest.raises(CommandError, match="out of range"):
                it.send("MANUAL_STEPPER STEPPER=free MOVE=" + goal)
        with pytest.raises(CommandError, match="No endstop"):
            it.send("MANUAL_STEPPER STEPPER=free MOVE=5 STOP_ON_ENDSTOP=home")
        assert position(it, "manual_stepper free") == 10.
    run(body, FREE)


def test_enable(run):
    def body(it):
        def is_on():
            return it.get("stepper_enable")["steppers"][NAME]
        it.send(MOVE + "ENABLE=1")
        assert is_on()
        it.send(MOVE + "MOVE=3 ENABLE=0")
        assert count(it, NAME) == 300 and is_on()      # the move needs it
        it.send(MOVE + "ENABLE=0")
        assert not is_on()
        it.send(MOVE + "MOVE=0\nM84")
        assert not is_on() and count(it, NAME) == 0
    run(body, ARM)


def test_sync(run):
    def body(it):
        it.send("G28\nG1 X10 F6000\nM400")
        # 40 mm take 2.1 s: the head does not wait, the next arm move does
        assert spent(it, MOVE + "MOVE=40 SYNC=0") < 0.3
        assert spent(it, MOVE + "SYNC=1") == pytest.approx(2.1, abs=0.3)
        assert spent(it, MOVE + "MOVE=0") == pytest.approx(2.1)
        begin = it.toolhead.get_last_move_time()
        it.send(MOVE + "MOVE=40 SYNC=0\nG1 X110 F6000\nG1 X10\n" + MOVE + "SYNC=1")
        together = it.toolhead.get_last_move_time() - begin
        assert together == pytest.approx(2.1, abs=0.3)
        assert count(it, NAME) == 4000 and max(it.get_error()) < 0.0063
    run(body, ARM)


@pytest.mark.parametrize("text, expected", [
    ("probe", (False, True, True)), ("home", (True, True, True)),
    ("inverted-probe", (False, False, True)), ("try-home", (True, True, False)),
    ("try-inverted-home", (True, False, False)),
    ("inverted-try-home", (True, False, False)), ("1", (True, True, True)),
    ("2", (True, True, False)), ("-1", (True, False, True)),
    ("-2", (True, False, False))])
def test_stop_modes(text, expected):
    mode = StopMode(text)
    assert (mode.is_homing, mode.level, mode.has_to_stop) == expected


@pytest.mark.parametrize("text", ["3", "", "try", "home-try", "try-try-home",
                                  "x-probe"])
def test_wrong_stop_modes(text):
    with pytest.raises(CommandError, match="STOP_ON_ENDSTOP"):
        StopMode(text)


def test_homing(run):
    def body(it):
        it.send(MOVE + "SET_POSITION=0 MOVE=-100 STOP_ON_ENDSTOP=home SPEED=15")
        # the trigger is at -100 now, and a little further it came to rest
        error = place(it) - (position(it) + 100.)
        assert abs(error) <= 1.01 * STEP and -0.1 < place(it) < STEP
        assert "arm:TRIGGERED" in query(it)
        it.send(MOVE + "SET_POSITION=0 MOVE=100 STOP_ON_ENDSTOP=inverted-probe")
        assert 0. <= place(it) < 0.2 and "arm:open" in query(it)
        # counted, not declared
        assert 0. < position(it) < 0.3
        it.send(MOVE + "MOVE=5\nM400")
        before = position(it)
        with pytest.raises(CommandError, match="No trigger on arm"):
            it.send(MOVE + "MOVE=8 STOP_ON_ENDSTOP=probe")
        assert position(it) == pytest.approx(8., abs=STEP) and before == 5.
        it.send(MOVE + "MOVE=9 STOP_ON_ENDSTOP=try-home")
        assert position(it) == 9.
        steps = count(it, NAME)
        it.send(MOVE + "MOVE=2")
        assert position(it) == 2. and count(it, NAME) == steps - 700
    run(body, ARM)


def query(it):
    it.send("QUERY_ENDSTOPS")
    return it.output[-1]


def test_probing_counts_the_way(run):
    def body(it):
        start = place(it)
        it.send(MOVE + "SET_POSITION=%.6f MOVE=-20 STOP_ON_ENDSTOP=probe" % (start,))
        assert position(it) == pytest.approx(place(it), abs=0.51 * STEP)
        it.send(MOVE + "MOVE=30")
        assert place(it) == pytest.approx(30., abs=0.51 * STEP)
        it.send("G28\nG1 X20 F6000")
        assert max(it.get_error()) < 0.0063
    run(body, ARM)


# As an axis of G-code

AXIS = "G28\nG90\nG1 X50 Y50 Z5 F6000\n" + MOVE + "GCODE_AXIS=A "


def test_moves_with_the_head(run):
    def body(it):
        it.send(AXIS + "\nG1 X80 A15 F3000\nG1 A20\nG91\nG1 Y5 A-2\nG90")
        assert count(it, NAME) == 1800 and position(it) == 18.
        assert it.get("gcode_move")["axis_map"]["A"] == 4
        assert it.get("toolhead")["extra_axes"][NAME] == 4
        assert it.get(NAME)["gcode_axis"] == "A"
        it.send("G92 A0\nG1 A3 X50")
        assert count(it, NAME) == 2100
        # G2 and plain moves leave it where it is
        it.send("G1 X55\nG2 X65 Y55 I5\nG1 E1")
        assert count(it, NAME) == 2100 and max(it.get_error()) < 0.0063
        it.send(MOVE + "GCODE_AXIS=\n" + MOVE + "MOVE=0")
        assert count(it, NAME) == 0
        assert list(it.get("gcode_move")["axis_map"]) == ["X", "Y", "Z", "E"]
        it.send("G1 A50 X60")
        assert count(it, NAME) == 0
    run(body, ARM + "[gcode_arcs]\n")


def test_limits_of_the_axis(run):
    def body(it):
        it.send(AXIS + "LIMIT_VELOCITY=10 LIMIT_ACCEL=100")
        # 20 mm of the axis, whatever the head could do
        assert spent(it, "G1 X70 A20 F12000") == pytest.approx(20. / 10. + 10. / 100.)
        assert spent(it, "G1 X69 A0") == pytest.approx(20. / 10. + 10. / 100.)
        # alone it keeps the accel of its section too
        it.send(MOVE + "GCODE_AXIS=B\nG1 F1200")
        assert spent(it, "G1 B20") == pytest.approx(20. / 20. + 20. / 200.)
    run(body, ARM)


def test_corners_of_the_axis(run):
    def body(it):
        def zigzag():
            return spent(it, "G1 X60 A1 F3000\nG1 X70 A0\nG1 X60 A1\nG1 X50 A0")
        it.send(AXIS + "INSTANTANEOUS_CORNER_VELOCITY=100")
        free = zigzag()
        it.send(MOVE + "GCODE_AXIS=A INSTANTANEOUS_CORNER_VELOCITY=0")
        rests = zigzag()
        it.send(MOVE + "GCODE_AXIS=A INSTANTANEOUS_CORNER_VELOCITY=2")
        slow = zigzag()
        assert free < slow - 0.001 < rests - 0.002
    run(body, ARM)


def test_range_of_the_axis(run):
    def body(it):
        it.send("G28\nMANUAL_STEPPER STEPPER=free GCODE_AXIS=C\nG1 X10 C50 F3000")
        with pytest.raises(CommandError, match="out of range of axis C"):
            it.send("G1 X20 C50.1")
        assert it.toolhead.get_position() == pytest.approx(
            [10., 200., 0.5, 0., 50.], abs=0.013)
        it.send("G1 C-10")
        assert count(it, "manual_stepper free") == -1000
    run(body, FREE)


def test_two_axes(run):
    def body(it):
        it.send(AXIS + "\nMANUAL_STEPPER STEPPER=free GCODE_AXIS=C")
        with pytest.raises(CommandError, match="already that of 'manual_stepper arm'"):
            it.send("MANUAL_STEPPER STEPPER=free GCODE_AXIS=A")
        it.send("G1 A5 C7\nG1 X60 C9")
        assert (count(it, NAME), count(it, "manual_stepper free")) == (500, 900)
        # the second one moves up when the first one leaves
        it.send(MOVE + "GCODE_AXIS=\nG1 C10 X50\n" + MOVE + "MOVE=6")
        assert (count(it, NAME), count(it, "manual_stepper free")) == (600, 1000)
    run(body, ARM + FREE)


@pytest.mark.parametrize("letter", ["X", "E", "F", "AB", "5", "N", "T", "G"])
def test_letters_that_are_taken(run, letter):
    def body(it):
        with pytest.raises(CommandError, match="GCODE_AXIS"):
            it.send(MOVE + "GCODE_AXIS=" + letter)
        assert it.get(NAME)["gcode_axis"] is None
    run(body, ARM)


def test_an_axis_has_no_moves_of_its_own(run):
    def body(it):
        it.send(AXIS)
        for rest in ("MOVE=3", "SET_POSITION=3", "MOVE=3 STOP_ON_ENDSTOP=probe"):
            with pytest.raises(CommandError, match="is G-code axis A"):
                it.send(MOVE + rest)
        assert math.isclose(position(it), 0.) and count(it, NAME) == 0
    run(body, ARM)


def list_pieces(it):
    """(start, end, speed there and here, accel, place at both ends) of the arm."""
    trapq = it.printer.lookup_object(NAME).get_trapq()
    pieces = []
    for time, duration, v, a, x, _, _, r, _, _ in reversed(
            trapq.extract_old(100000, 0., 1e9)):
        if duration:
            way = (v + 0.5 * a * duration) * duration
            pieces.append((time, time + duration, r * v, r * (v + a * duration), abs(a),
                           x, x + r * way))
    return pieces


@pytest.mark.parametrize("jump", [0., 1.5, 8.])
def test_no_limit_of_the_axis_is_exceeded(run, jump):
    """In every piece of a random walk, and between any two."""
    def body(it):
        draw = random.Random(11)
        it.send(AXIS + "LIMIT_VELOCITY=12 LIMIT_ACCEL=150"
                " INSTANTANEOUS_CORNER_VELOCITY=%g" % (jump,))
        it.toolhead.wait_moves()
        for _ in range(120):
            it.send("G1 X%.3f Y%.3f A%.3f F%d" % (
                50. + draw.uniform(0., 4.), 50. + draw.uniform(0., 4.),
                draw.choice([0., draw.uniform(0., 3.)]), draw.choice([1200, 12000])))
        it.toolhead.wait_moves()
        pieces = list_pieces(it)
        assert len(pieces) > 100
        assert max(max(abs(p[2]), abs(p[3])) for p in pieces) <= 12. + 1e-6
        assert 140. < max(p[4] for p in pieces) <= 150. + 1e-6
        worst = 0.
        for before, after in itertools.pairwise(pieces):
            assert after[5] == pytest.approx(before[6], abs=1e-6)
            if after[0] - before[1] < 1e-9:
                worst = max(worst, abs(after[2] - before[3]))
            else:           # it rests in between
                worst = max(worst, abs(after[2]), abs(before[3]))
        assert worst <= jump + 1e-6 and worst >= 0.5 * jump
    run(body, ARM)


def test_a_machine_of_extra_axes_alone(tmp_path, monkeypatch):
    """Without kinematics: two motors, moved together by G1."""
    def body(it):
        it.send(MOVE + "GCODE_AXIS=A\nMANUAL_STEPPER STEPPER=free GCODE_AXIS=B")
        assert spent(it, "G1 A20 B5 F600") == pytest.approx(20. / 10. + 10. / 200.)
        it.send("G1 B10\nG91\nG1 A-5\nM400")
        assert (count(it, NAME), count(it, "manual_stepper free")) == (1500, 1000)
        assert it.get("toolhead")["position"][4:] == (15., 10.)
    config = """
[mcu]
serial: /dev/none
[printer]
kinematics: none
max_velocity: 100
max_accel: 1000
"""
    motion_machine.make_run(tmp_path, monkeypatch, config)(body, ARM + FREE)
