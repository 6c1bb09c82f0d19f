# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps made by several threads are those that one makes."""

import math
import random

import pytest
from motion_rig import Rig, make_move

from klippy_ext.kin_extruder import ExtruderKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.steppool import StepPool

FREQ = 16e6


def make_rig():
    """A corexy machine and a drive, with a path of short moves."""
    drive = ExtruderKinematics()
    drive.set_pressure_advance(0.0, 0.05, 0.04)
    rig = Rig([LinearKinematics(1.0, 1.0, 0.0), LinearKinematics(1.0, -1.0, 0.0),
               drive], 0.01, FREQ)
    draw, t, position, angle = random.Random(4), 1.0, rig.start, 0.0
    for _ in range(400):
        angle += draw.uniform(-0.3, 0.3)
        move = make_move(0.0, 0.01, 0.0, position,
                         (math.cos(angle), math.sin(angle), 0.0), 50.0, 50.0, 3e3)
        t, position = rig.add(t, move)
    return rig, t


def make_steps(n_threads, meanwhile=lambda rig: None):
    """All messages; `meanwhile` is called while steps are made."""
    rig, end = make_rig()
    pool, t = StepPool(n_threads), 0.0
    while t < end + 0.5:
        t += 0.25
        rig.sync.start(pool, t + 0.05, int(t * FREQ))
        pool.check()
        pool.start()
        pool.check()
        meanwhile(rig)
        pool.check()
        pool.finish()
        pool.check()
        rig.sync.finish(t + 0.05)
        rig.sync.flush(int(t * FREQ))
        rig.sync.check()
    return rig.store.take()


@pytest.fixture(scope="module")
def wanted():
    """The messages of a single thread that knows no pool."""
    rig, end = make_rig()
    t = 0.0
    while t < end + 0.5:
        t += 0.25
        rig.sync.generate(t + 0.05)
        rig.sync.flush(int(t * FREQ))
    messages = rig.store.take()
    assert len(messages) > 500
    return messages


@pytest.mark.parametrize("n_threads", [0, 1, 3, 8])
def test_messages_do_not_depend_on_the_number_of_threads(wanted, n_threads):
    assert make_steps(n_threads) == wanted


@pytest.mark.parametrize("n_threads", [0, 2])
def test_who_asks_meanwhile_waits_for_the_steps(wanted, n_threads):
    seen = []

    def ask(rig):
        seen.append((rig.steppers[0].get_last_position(),
                     round(rig.kinematics[0].get_commanded_pos() / 0.01)))
        rig.tq.extract_old(3, 0.0, 10.0)
    assert make_steps(n_threads, ask) == wanted
    assert all(steps == position for steps, position in seen)
    assert len(set(seen)) > 10


@pytest.mark.parametrize("n_threads", [0, 2])
def test_a_jump_is_told_when_finished(n_threads):
    rig, end = make_rig()
    rig.kinematics[1].set_position(50.0, 0.0, 0.0)
    pool = StepPool(n_threads)
    rig.sync.start(pool, end, int(end * FREQ))
    pool.start()
    pool.finish()
    with pytest.raises(ValueError, match="stepper with oid 1: the position"):
        rig.sync.finish(end)


def test_a_pool_may_die_while_steps_are_made(wanted):
    rig, end = make_rig()
    pool = StepPool(1)
    rig.sync.start(pool, end, int(end * FREQ))
    pool.start()
    del pool
    rig.sync.finish(end)
    assert rig.steppers[0].get_counts()[0] > 1000


def test_a_pool_has_no_negative_number_of_threads():
    with pytest.raises(ValueError, match="0 threads or more, not -1"):
        StepPool(-1)
