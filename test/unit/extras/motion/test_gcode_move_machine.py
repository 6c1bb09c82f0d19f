# SPDX-License-Identifier: GPL-3.0-or-later
"""G-code moves with the real toolhead on the simulated machine."""

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError


@pytest.fixture
def run(tmp_path, monkeypatch):
    def run(body, config=CARTESIAN):
        motion_bench.MotionBench(tmp_path, monkeypatch, config).run_ready(body)
    return run


def note_calls(obj, name):
    """A list of the calls of a method from now on."""
    calls, method = [], getattr(obj, name)

    def call(*args):
        calls.append(args)
        return method(*args)
    setattr(obj, name, call)
    return calls


def true_position(it):
    assert max(it.get_error()) < 0.0063
    return it.machine.calc_position()


def test_plain_lines_reach_the_toolhead_as_numbers(run):
    def body(it):
        it.send("G28")
        calls = note_calls(it.toolhead, "move_xyze")
        it.send("G1 X10 Y20 F6000\nG1 Z3 F600\nG1 X12 (general)")
        assert [call[:3] for call in calls] == [
            pytest.approx((10., 20., 0.5)), pytest.approx((10., 20., 3.)),
            pytest.approx((12., 20., 3.))]
        assert true_position(it) == pytest.approx((12., 20., 3.), abs=0.01)
    run(body)


def test_refused_moves(run):
    def body(it):
        with pytest.raises(CommandError, match="Must home"):
            it.send("G1 X10")
        it.send("G28\nG1 X10 F6000")
        for line in ("G1 X201", "G1 X20 Y-7", "G1 Z500 (general)", "G1 X20 E5"):
            with pytest.raises(CommandError):
                it.send(line)
            assert it.get("gcode_move")["position"][:2] == pytest.approx(
                it.toolhead.get_position()[:2])
        it.send("G91\nG1 X5\nG90")
        assert true_position(it)[0] == pytest.approx(15., abs=0.01)
    run(body)


def test_left_out_objects(run):
    def body(it):
        it.send("G28\nG1 X10 Y10 Z5 F6000\nEXCLUDE_OBJECT NAME=a\n"
                "EXCLUDE_OBJECT_START NAME=a\nG1 X50\nG1 Y50\nEXCLUDE_OBJECT_END")
        assert true_position(it)[:2] == pytest.approx((10., 10.), abs=0.01)
        it.send("G1 X60")
        assert true_position(it)[:2] == pytest.approx((60., 50.), abs=0.01)
    run(body, CARTESIAN + "[exclude_object]\n")


class Axis:
    """An axis beyond e that only notes its moves."""

    def __init__(self):
        self.ways = []

    def get_axis_gcode_id(self):
        return "A"

    def check_move(self, move, index):
        if move.axes_d[index] > 100.:
            raise move.move_error("too far")

    def calc_junction(self, prev_move, move, index):
        return 1e9

    def process_move(self, print_time, move, index):
        self.ways.append(move.axes_d[index])

    def get_name(self):
        return "axis"


def test_further_axis(run):
    def body(it):
        it.send("G28\nG1 X10 Y10 F6000")
        axis = Axis()
        it.toolhead.add_extra_axis(axis, 5.)
        assert it.get("gcode_move")["axis_map"]["A"] == 4
        it.send("G1 X20 A7\nG1 X25\nG1 A9")
        assert it.toolhead.get_position()[4] == 9.
        with pytest.raises(CommandError, match="too far"):
            it.send("G1 A200")
        assert it.get("gcode_move")["position"][4] == 9.
        assert true_position(it)[0] == pytest.approx(25., abs=0.01)
        assert axis.ways == [pytest.approx(2.), pytest.approx(2.)]
        it.toolhead.remove_extra_axis(axis)
        assert "A" not in it.get("gcode_move")["axis_map"]
        calls = note_calls(it.toolhead, "move_xyze")
        it.send("G1 X30 A300")
        assert len(calls) == 1
        assert true_position(it)[0] == pytest.approx(30., abs=0.01)
    run(body)


def test_manual_moves_are_known_to_the_gcode(run):
    def body(it):
        it.send("G28\nG1 X10 Y10 Z5 F6000")
        it.toolhead.manual_move([30., None, None], 50.)
        it.send("G91\nG1 X1\nG90")
        assert true_position(it)[0] == pytest.approx(31., abs=0.01)
        it.toolhead.set_position([50., 50., 5., 0.])
        assert it.get("gcode_move")["position"][:3] == (50., 50., 5.)
    run(body)
