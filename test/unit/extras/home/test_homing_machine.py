# SPDX-License-Identifier: GPL-3.0-or-later
"""Homing on the simulated machine leaves the head where the printer says."""

import pathlib

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError

CONFIG = pathlib.Path(__file__).resolve().parents[4] / "config"
STEPS = {"cartesian": (0.0125, 0.0125, 0.0025), "corexy": (0.0125, 0.0125, 0.0025),
         "delta": (0.03, 0.03, 0.0125)}


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(config=CARTESIAN, **options):
        return motion_bench.MotionBench(tmp_path, monkeypatch, config, **options)
    return make


def assert_true(it, steps=STEPS["cartesian"]):
    for error, step in zip(it.get_error(), steps, strict=True):
        assert error <= step, it.get_error()


def homed(it):
    return it.get("toolhead")["homed_axes"]


@pytest.mark.parametrize("kind", ["cartesian", "corexy", "delta"])
def test_sample_machines_know_where_they_are(make_bench, kind):
    def body(it):
        assert homed(it) == ""
        it.send("G28")
        assert homed(it) == "xyz"
        assert_true(it, STEPS[kind])
        it.send("G90\nG1 Z60 F1200\nG1 X20 Y31 F12000\nG1 X12.5 Y-2\nG1 Z50" if kind
                == "delta" else "G1 Z20 F600\nG1 X100 Y31 F12000\nG1 X12.5 Y177")
        assert_true(it, STEPS[kind])
        # once more, from somewhere else and at other speeds
        it.send("G28")
        assert_true(it, STEPS[kind])
    make_bench((CONFIG / ("sample-%s.cfg" % kind)).read_text()).run_ready(body)


def test_single_axes(make_bench):
    def body(it):
        it.send("G28 Y")
        assert homed(it) == "y"
        it.send("G28 X0 Z0")
        assert homed(it) == "xyz"
        assert_true(it)
        position = it.toolhead.get_position()
        assert position[:2] == pytest.approx([0., 200.], abs=0.0126)
    make_bench().run_ready(body)


def test_no_trigger_after_the_full_way(make_bench):
    def body(it):
        with pytest.raises(CommandError, match="No trigger on x after full movement"):
            it.send("G28 X")
        assert homed(it) == ""
        before = it.machine.get_step_counts()["stepper_x"]
        with pytest.raises(CommandError, match="Must home"):
            it.send("G1 X5")
        # the motors are sound: 600 mm nearer, the switch is in reach
        it.send("G28 X")
        assert abs(it.machine.get_step_counts()["stepper_x"] - before) > 1000
        assert homed(it) == "x"
    make_bench(CARTESIAN + "[simulator]\nstart_position: 500, 50, 5\n").run_ready(body)


def test_switch_that_is_stuck(make_bench):
    def body(it):
        with pytest.raises(CommandError, match="x still triggered after retract"):
            it.send("G28 X")
        assert homed(it) == ""
        it.send("QUERY_ENDSTOPS")
        assert "x:TRIGGERED" in it.output[-1]
    # a switch far below the others' zero: pressed wherever the head is
    config = CARTESIAN + "[simulator]\nstart_position: -100, 50, 5\n"
    make_bench(config).run_ready(body)


def test_query_endstops(make_bench):
    def body(it):
        it.send("M119")
        assert it.output[-1] == "x:open y:open z:open"
        it.send("G28 X")
        it.send("G1 X0")
        it.send("QUERY_ENDSTOPS")
        assert it.output[-1] == "x:TRIGGERED y:open z:open"
        assert it.get("query_endstops")["last_query"] == {"x": 1, "y": 0, "z": 0}
    make_bench().run_ready(body)
