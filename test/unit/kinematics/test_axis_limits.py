# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits of x and y on their own."""

import math

import motion_bench
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError

OPTIONS = ("max_x_velocity: 100\nmax_y_velocity: 60\nmax_x_accel: 2000\n"
           "max_y_accel: 500\n")


def make_config(kind, options=OPTIONS):
    return CARTESIAN.replace("kinematics: cartesian\n",
                             "kinematics: limited_%s\n%s" % (kind, options))


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(kind, options=OPTIONS):
        return motion_bench.MotionBench(tmp_path, monkeypatch,
                                        make_config(kind, options))
    return make


def take_limits(it, x, y, z=0.):
    """(speed, acceleration) that a move by these ways is given."""
    toolhead = it.toolhead
    start = toolhead.get_position()
    toolhead.move([start[0] + x, start[1] + y, start[2] + z, start[3]], 300.)
    move = toolhead.lookahead.get_last()
    return math.sqrt(move.max_cruise_v2), move.accel


@pytest.mark.parametrize("kind, shared", [("cartesian", False), ("corexy", True),
                                          ("corexz", False)])
def test_each_axis_is_limited(make_bench, kind, shared):
    def body(it):
        it.send("G28\nG1 X50 Y50 Z10 F6000")
        assert take_limits(it, 10., 0.) == pytest.approx((100., 2000.))
        assert take_limits(it, 0., -10.) == pytest.approx((60., 500.))
        assert take_limits(it, 0., 0., 5.) == pytest.approx((25., 100.))
        # 3 : 4, where y is the slower one
        accel = 1. / (0.6 / 2000. + 0.8 / 500.) if shared else 500. / 0.8
        assert take_limits(it, -3., 4.) == pytest.approx((60. / 0.8, accel))
        # z is slower than either
        root = math.sqrt(3.)
        speed, accel = take_limits(it, 2., 2., 2.)
        assert speed == pytest.approx(25. * root)
        assert accel == pytest.approx(100. * root)
        with pytest.raises(CommandError, match="Move out of range"):
            it.send("G1 X300")
        assert max(it.get_error()) <= 0.0125 + 1e-9
    make_bench(kind).run_ready(body)


def test_command_and_status(make_bench):
    def body(it):
        it.send("G28\nG1 X50 Y50 Z10 F6000")
        it.send("SET_KINEMATICS_LIMIT X_VELOCITY=50 Y_ACCEL=900 Z_VELOCITY=5 Z_ACCEL=7")
        assert take_limits(it, 10., 0.) == pytest.approx((50., 2000.))
        assert take_limits(it, 0., 10.) == pytest.approx((60., 900.))
        assert take_limits(it, 0., 0., 1.) == pytest.approx((5., 7.))
        status = it.get("toolhead")
        assert [status["max_%s_velocity" % a] for a in "xyz"] == [50., 60., 5.]
        assert [status["max_%s_accel" % a] for a in "xyz"] == [2000., 900., 7.]
        assert status["scale_xy_accel"] is False and status["homed_axes"] == "xyz"
        for wrong in ("X_ACCEL=0", "Z_VELOCITY=-1", "SCALE=2"):
            with pytest.raises(CommandError):
                it.send("SET_KINEMATICS_LIMIT Y_VELOCITY=1 " + wrong)
        # An error changes nothing
        assert it.get("toolhead")["max_y_velocity"] == 60.
    make_bench("cartesian").run_ready(body)


def test_scaled_by_the_printers_acceleration(make_bench):
    def body(it):
        it.send("G28\nG1 X50 Y50 Z10 F6000")
        full = math.hypot(2000., 500.)
        # 3000 is beyond both together: the limits as they are
        assert take_limits(it, 10., 0.)[1] == pytest.approx(2000.)
        it.send("SET_VELOCITY_LIMIT ACCEL=1000")
        assert take_limits(it, 10., 0.)[1] == pytest.approx(2000. * 1000. / full)
        assert take_limits(it, 0., 10.)[1] == pytest.approx(500. * 1000. / full)
        it.send("SET_KINEMATICS_LIMIT SCALE=0")
        assert take_limits(it, 0., 10.)[1] == pytest.approx(500.)
    make_bench("cartesian", OPTIONS + "scale_xy_accel: True\n").run_ready(body)


def test_without_options_only_the_way_is_limited(make_bench):
    def body(it):
        it.send("G28\nG1 X50 Y50 Z10 F6000")
        speed, accel = take_limits(it, 10., 10.)
        assert (speed, accel) == pytest.approx((300., 3000.))
    make_bench("cartesian", "").run_ready(body)


def test_speed_of_the_machine(make_bench):
    """The motors take the time that y needs."""
    def body(it):
        it.send("G28\nG1 X50 Y50 Z10 F6000")
        start = it.toolhead.get_last_move_time()
        it.send("G1 Y170 F18000")
        # 120 mm at 60 mm/s, 500 mm/s^2, and the way to speed up
        took = it.toolhead.get_last_move_time() - start
        assert took == pytest.approx(2. + 0.12, abs=0.005)
        assert max(it.get_error()) <= 0.0125 + 1e-9
    make_bench("cartesian").run_ready(body)
