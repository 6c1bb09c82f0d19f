# SPDX-License-Identifier: GPL-3.0-or-later
"""Which axes are homed: BoxMachine (each by itself) and ArmsMachine (all or none)."""

import pathlib

import motion_bench
import pytest

from klippy.errors import CommandError
from klippy.kinematics.arms import ArmsMachine, find_meeting
from klippy.kinematics.box import BoxMachine

CONFIG = pathlib.Path(__file__).resolve().parents[3] / "config"
# What is homed after one axis at a time was asked for: x, y, z
ALONE = ("x", "y", "z")
# x and y of a polar machine, x and z of a deltesian come and go together
KINDS = {"cartesian": (BoxMachine, ALONE), "corexy": (BoxMachine, ALONE),
         "polar": (BoxMachine, ("", "", "z")),
         "deltesian": (BoxMachine, ALONE),
         "delta": (ArmsMachine, ("", "", "")),
         "rotary_delta": (ArmsMachine, ("", "", ""))}
LEFT_AFTER_CLEARING_X = {"cartesian": "yz", "corexy": "yz", "polar": "z",
                         "deltesian": "y", "delta": "", "rotary_delta": ""}


@pytest.fixture
def run_on(tmp_path, monkeypatch):
    def run(kind, body):
        config = (CONFIG / ("sample-%s.cfg" % kind)).read_text()
        motion_bench.MotionBench(tmp_path, monkeypatch, config).run_ready(
            lambda it: body(it.toolhead.get_kinematics()))
    return run


def get_homed(kin):
    return kin.get_status(0.)["homed_axes"]


@pytest.mark.parametrize("kind", KINDS)
def test_axes_become_homed_by_a_set_position(run_on, kind):
    def body(kin):
        base, alone = KINDS[kind]
        assert isinstance(kin, base)
        for axis, homed in zip("xyz", alone, strict=True):
            kin.clear_homing_state("xyz")
            kin.set_position([1., 2., 3.], axis)
            assert get_homed(kin) == homed
        kin.set_position([1., 2., 3.], "xyz")
        assert get_homed(kin) == "xyz"
        assert kin.calc_position({
            motor.get_name(): motor.get_commanded_position()
            for motor in kin.get_steppers()}) == pytest.approx([1., 2., 3.])
    run_on(kind, body)


@pytest.mark.parametrize("kind", KINDS)
def test_axes_are_lost(run_on, kind):
    def body(kin):
        kin.set_position([0., 0., 0.], "xyz")
        kin.clear_homing_state("")
        assert get_homed(kin) == "xyz"
        kin.clear_homing_state("x")
        assert get_homed(kin) == LEFT_AFTER_CLEARING_X[kind]
        kin.set_position([0., 0., 0.], "xyz")
        kin.note_z_not_homed()
        assert "z" not in get_homed(kin)
        kin.set_position([0., 0., 0.], "xyz")
        kin.printer.send_event("stepper_enable:motor_off", 1.)
        assert get_homed(kin) == ""
    run_on(kind, body)


def test_arms_that_do_not_meet():
    corners = [(0., 0., 0.), (100., 0., 0.), (0., 100., 0.)]
    assert find_meeting(corners, [7500.] * 3, "") == pytest.approx([50., 50., -50.])
    with pytest.raises(CommandError, match="No head is held by short arms: "):
        find_meeting(corners, [100.] * 3, "short arms")
