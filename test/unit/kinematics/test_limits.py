# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from klippy.errors import CommandError
from klippy.kinematics.limits import MoveLimits, list_axes
from klippy.lookahead import MotionLimits, Move

GENERAL = MotionLimits(300., 3000., 0.5, 5.)


@pytest.fixture
def limits():
    made = MoveLimits([(0., 200.), (-5., 150.), (-1., 100.)], 10., 50.)
    for axis in range(3):
        made.set_homed(axis)
    return made


def make_move(end, start=(50., 50., 10., 0.), speed=100.):
    return Move(GENERAL, start, end, speed)


def test_moves_within_pass_unchanged(limits):
    for end in ((200., 50., 10., 0.), (0., -5., 10., 0.), (50., 150., 10., 1.)):
        move = make_move(end)
        limits.check_move(move)
        assert (move.max_cruise_v2, move.accel) == (100. ** 2, 3000.)


@pytest.mark.parametrize("end, words", [
    ((200.001, 50., 10., 0.), r"range: 200.001 50.000 10.000 \[0.000\] "
                              r"\(X 200.001 is not within 0.000 to 200.000\)"),
    ((-0.001, 50., 10., 0.), "X -0.001 is not within"),
    ((60., 151., 10., 0.), "Y 151.000 is not within -5.000 to 150.000"),
    ((60., 70., -2., 0.), "Z -2.000 is not within -1.000 to 100.000")])
def test_moves_beyond_are_refused(limits, end, words):
    with pytest.raises(CommandError, match=words):
        limits.check_move(make_move(end))


def test_axes_that_rest_may_be_anywhere(limits):
    limits.clear_homed(1)
    start = 50., -99., 10., 0.
    limits.check_move(make_move((60., -99., 10., 0.), start))
    with pytest.raises(CommandError, match=r"Must home axis first: .*\(Y is not homed"):
        limits.check_move(make_move((60., -98., 10., 0.), start))


def test_z_is_slow(limits):
    move = make_move((53., 50., 14., 0.))
    limits.check_move(move)
    # 5 mm of way for 4 mm of z
    assert move.max_cruise_v2 == pytest.approx(12.5 ** 2)
    assert move.accel == pytest.approx(62.5)


def test_state(limits):
    assert limits.get_homed() == "xyz"
    limits.clear_homed(0)
    assert limits.get_homed() == "yz" and not limits.is_homed(0)
    limits.set_range(0, 10., 20.)
    assert not limits.is_homed(0) and limits.get_range(0) == (10., 20.)
    limits.set_homed(0)
    limits.set_range(1, 0., 7.)
    assert limits.is_homed(1)
    status = limits.get_status()
    assert status["homed_axes"] == "xyz"
    assert status["axis_minimum"] == (10., 0., -1., 0.)
    assert status["axis_maximum"] == (20., 7., 100., 0.)


def test_as_a_list_of_ranges(limits):
    assert limits[2] == (-1., 100.)
    limits[2] = (3., 4.)
    with pytest.raises(CommandError):
        limits.check_move(make_move((50., 50., 5., 0.)))
    limits.clear_homed(2)
    low, high = limits[2]
    assert low > high


def test_axes_by_name_or_index():
    assert list_axes("xz") == [0, 2] and list_axes((1, 2)) == [1, 2]
    assert list_axes("") == []
