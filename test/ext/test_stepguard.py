# SPDX-License-Identifier: GPL-3.0-or-later
"""A guard that goes on with motion when nobody disarms it."""

import time

import pytest

from klippy_ext.hostclock import RealClock
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.realtime import get_thread_counts
from klippy_ext.stepcompress import StepCompress
from klippy_ext.stepguard import StepGuard
from klippy_ext.steppersync import MessageStore, StepperSync
from klippy_ext.trapq import TrapMove, TrapQ
from klippy_ext.vworld import VirtualWorld

FREQ = 1e6
STEP = 0.0125


class Axis:
    """One stepper on a queue of motion, and the messages for its mcu."""

    def __init__(self, clock):
        self.trapq, self.store = TrapQ(), MessageStore()
        self.stepcompress, self.kinematics = StepCompress(0), LinearKinematics(1, 0, 0)
        self.stepcompress.configure(25, 1, 2)
        self.kinematics.set_stepcompress(self.stepcompress, STEP)
        self.kinematics.set_trapq(self.trapq)
        self.sync = StepperSync(self.store, 500)
        self.sync.add(self.stepcompress, self.kinematics)
        self.sync.set_time(0., FREQ)
        self.guard = StepGuard(clock)
        self.guard.add(self.sync)

    def move(self, start, duration, begin=0.):
        """10 mm/s along x."""
        move = TrapMove()
        move.start_x, move.axes_r_x = begin, 1.
        move.cruise_t, move.start_v, move.cruise_v = duration, 10., 10.
        self.trapq.append(start, move)

    def last_clock(self):
        """Of the steps that were sent so far; 0 without any."""
        self.store.take()
        runs = self.stepcompress.extract_old(1, 0, 1 << 60)
        return runs[0][1] if runs else 0

    def position(self):
        return self.kinematics.get_commanded_pos()


@pytest.fixture
def world():
    return VirtualWorld(seed=1)


def test_pieces_come_just_in_time(world):
    axis = Axis(world)
    axis.move(0., 2.)
    axis.guard.arm(0., 5., 2.1, 1., 0.1)
    world.advance(0.999)
    assert axis.position() == 0.
    for i in range(1, 9):
        world.advance(0.76 + 0.25 * i)
        assert axis.position() == pytest.approx(2.5 * i, abs=STEP)
        assert axis.last_clock() == pytest.approx(0.25e6 * i, abs=0.03e6)
    world.advance(10.)
    assert axis.position() == pytest.approx(20., abs=STEP)
    assert axis.guard.disarm() == 2.1
    assert axis.guard.disarm() is None


def test_a_piece_ends_where_the_plan_is_uncertain(world):
    axis = Axis(world)
    axis.move(0., 2.)
    axis.guard.arm(0., 0.1, 2., 1., 0.1)
    world.advance(1.05)
    assert axis.guard.disarm() == 0.1
    axis.guard.arm(0.1, 0.1, 2., 1.1, 0.1)
    world.advance(1.2)
    assert axis.guard.disarm() == pytest.approx(0.35)


def test_nothing_happens_disarmed_or_too_late(world):
    axis = Axis(world)
    axis.move(0., 2.)
    axis.guard.arm(0., 5., 2., 1., 0.1)
    assert axis.guard.disarm() == 0.
    world.advance(3.)
    assert axis.position() == 0.
    # the time for the first piece is long gone
    axis.guard.arm(0., 5., 2., 1., 0.1)
    world.advance(4.)
    assert axis.guard.disarm() == 0.


def test_a_rewound_way_leaves_no_step(world):
    axis = Axis(world)
    axis.move(0., 1.)
    axis.trapq.mark()
    axis.move(1., 1., 10.)
    axis.guard.arm(0., 1., 2., 1., 0.1)
    world.advance(1.3)
    assert axis.guard.disarm() == 0.5
    axis.trapq.rewind()
    axis.trapq.check()
    axis.sync.generate(3.)
    assert axis.position() == pytest.approx(10., abs=STEP)
    axis.sync.check()


def test_errors_reach_who_disarms(world):
    axis = Axis(world)
    axis.trapq.set_position(0., 5., 0., 0.)
    axis.move(1., 1., 5.)
    axis.guard.arm(0., 5., 2., 1., 0.1)
    world.advance(5.)
    with pytest.raises(ValueError, match="jumps"):
        axis.guard.disarm()
    assert axis.guard.disarm() is None


def test_a_dropped_guard_is_called_no_more(world):
    axis = Axis(world)
    axis.move(0., 2.)
    axis.guard.arm(0., 5., 2., 1., 0.1)
    axis.guard = None
    world.advance(3.)
    assert axis.position() == 0.


def test_a_real_clock_has_a_thread():
    """The main thread holds the GIL all the while."""
    clock = RealClock()
    axis = Axis(clock)
    axis.move(0., 0.5)
    before = sum(get_thread_counts())
    axis.guard.arm(0., 5., 0.5, clock.monotonic() + 0.02, 10.)
    end = time.monotonic() + 10.
    while axis.position() < 4.9 and time.monotonic() < end:
        pass
    assert axis.position() == pytest.approx(5., abs=STEP)
    assert axis.guard.disarm() == 0.5
    assert sum(get_thread_counts()) == before + 1
