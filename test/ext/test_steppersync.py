# SPDX-License-Identifier: GPL-3.0-or-later
"""Order of messages and the mcu's move queue, of several steppers."""

import heapq
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_moves import journeys, travel
from motion_rig import QUEUE_STEP, SET_DIR, Rig, decode, make_move

from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.stepcompress import StepCompress
from klippy_ext.steppersync import MessageStore, StepperSync
from klippy_ext.trapq import TrapQ

ROWS = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0)]


def run_length(args):
    _, interval, count, add = args
    add -= (add & 0x80000000) << 1
    return interval * count + add * (count * (count - 1) // 2)


def most_cells_in_use(commands):
    """Cells in use if each message comes as early as it may.

    A run's cell is free when the run before it has made its last step; that
    of another message when it is due.
    """
    free, ends, now, most = [], {}, 0, 0
    for name, args, min_clock, req_clock in commands:
        now = max(now, min_clock)
        if name == "step":
            oid = args[0]
            assert min_clock <= req_clock
            heapq.heappush(free, ends.get(oid, 0))
            ends[oid] = req_clock - args[1] + run_length(args)
        elif min_clock:
            heapq.heappush(free, req_clock)
        while free and free[0] <= now:
            heapq.heappop(free)
        most = max(most, len(free))
    return most


@settings(max_examples=40, deadline=None)
@given(journeys(), st.sampled_from([1, 4, 16, 300]), st.sampled_from([0.05, 0.5, 30.0]))
def test_move_queue_never_overflows(journey, move_count, flush_period):
    rig = Rig([LinearKinematics(*row) for row in ROWS], 0.003, move_count=move_count)
    end = travel(rig, journey, 0.3)
    rig.run(end + 0.1, flush_period)
    assert most_cells_in_use(rig.commands) <= move_count
    needed = [c[3] for c in rig.commands]
    if flush_period > 20.0:
        assert needed == sorted(needed)
    for oid in range(len(ROWS)):
        own = [c[3] for c in rig.commands if c[1][0] == oid]
        assert own == sorted(own)


def test_cells_are_really_used():
    """The same with a queue of every size: more cells, earlier messages."""
    least = {}
    for move_count in (1, 2, 8, 50):
        rig = Rig([LinearKinematics(*row) for row in ROWS], 0.003, max_error=0.0,
                  move_count=move_count)
        t, _ = rig.add(1.0, make_move(0.1, 0.1, 0.1, rig.start, (0.6, 0.8, 0.0), 0.0,
                                      50.0, 500.0))
        rig.run(t + 0.1)
        runs = [c for c in rig.commands if c[0] == "step"]
        assert len(runs) > 100
        assert most_cells_in_use(rig.commands) == move_count
        least[move_count] = sum(c[2] for c in runs)
        # the first ones may come at once
        assert [c[2] for c in runs[:move_count]] == [0] * move_count
    assert sorted(least.values(), reverse=True) == list(least.values())


def make_pair(move_count=10):
    store = MessageStore()
    sync = StepperSync(store, move_count)
    steppers = [StepCompress(oid) for oid in range(2)]
    sync.set_time(0.0, 1e6)
    for sc in steppers:
        sc.configure(25, QUEUE_STEP, SET_DIR)
        sync.add(sc)            # the time that was set is theirs, too
    return store, sync, steppers


def test_flush_sends_what_is_needed_before_a_clock():
    store, sync, (a, b) = make_pair()
    a.push(np.array([1.0, 2.0, 3.0]), 1)
    b.push(np.array([1.5, 2.5]), -1)
    b.push(np.array([4.5]), 1)
    sync.flush(1500000)
    assert [(c[0], c[1][0]) for c in decode(store.take())] == [("dir", 0), ("step", 0)]
    sync.flush(1500001)
    assert [(c[0], c[1][0]) for c in decode(store.take())] == [("dir", 1), ("step", 1)]
    sync.flush(4000000)
    assert [(c[3], c[1][0]) for c in decode(store.take())] == [(2500000, 1),
                                                               (3000000, 0)]
    sync.flush(5000000)
    assert [c[3] for c in decode(store.take())] == [4500000, 4500000]
    sync.flush(6000000)
    assert store.take() == []


def test_direction_takes_no_cell_and_comes_right_before_its_run():
    store, sync, (a, b) = make_pair(1)
    a.push(np.array([1.0]), 1)
    b.push(np.array([1.0]), 1)
    a.push(np.array([2.0]), -1)
    sync.flush(3000000)
    names = [(c[0], c[1][0], c[2], c[3]) for c in decode(store.take())]
    assert names == [("dir", 0, 0, 1000000), ("step", 0, 0, 1000000),
                     ("dir", 1, 0, 1000000), ("step", 1, 1000000, 1000000),
                     ("dir", 0, 0, 2000000), ("step", 0, 1000000, 2000000)]


def test_emitter_shares_the_move_queue():
    store, sync, (pwm, stepper) = make_pair(2)
    for i in range(6):
        pwm.queue_message(b"\x63\x00", 1000000 * (i + 1))
    pwm.queue_message(b"\x64\x00")      # a plain one: takes no cell
    stepper.push(np.array([2.5]), 1)
    sync.flush(10000000)
    commands = decode(store.take())
    assert most_cells_in_use(commands) <= 2
    assert [c[2] for c in commands if c[1] == [0]] == [0, 0, 2000000, 2500000, 3000000,
                                                       4000000, 0]


def test_plain_message_is_never_held_back():
    store, sync, (a, _) = make_pair()
    a.queue_message(b"\x63\x07")
    sync.flush(1)
    assert decode(store.take()) == [("other", [7], 0, 0)]


def test_other_threads_run_meanwhile():
    rig = Rig([LinearKinematics(*row) for row in ROWS], 0.0002)
    t = 1.0
    for _ in range(20):
        t, _ = rig.add(t, make_move(0.0, 1.0, 0.0, rig.start, (0.6, 0.8, 0.0), 100.0,
                                    100.0, 0.0))
        rig.start = tuple(rig.position)
    inside, seen = threading.Event(), []

    def watch():
        inside.wait()
        while len(seen) < 1000:
            seen.append(rig.kinematics[0].scan_window())
    watcher = threading.Thread(target=watch)
    watcher.start()
    inside.set()
    rig.sync.generate(t)
    done_meanwhile = len(seen)
    watcher.join()
    assert done_meanwhile == 1000


def test_kinematics_can_be_changed():
    store, sync, (a, b) = make_pair()
    first, second, tq = LinearKinematics(1, 0, 0), LinearKinematics(0, 1, 0), TrapQ()
    for kin in (first, second):
        kin.set_trapq(tq)
        kin.set_stepcompress(a, 0.1)
    sync.set_kinematics(a, first)
    tq.append(1.0, make_move(0.0, 1.0, 0.0, (0, 0, 0), (1, 0, 0), 10.0, 10.0, 0.0))
    sync.generate(2.5)
    assert a.get_last_position() == 100
    sync.set_kinematics(a, second)
    second.generate_steps(2.5)
    tq.append(3.0, make_move(0.0, 1.0, 0.0, (10, 0, 0), (0, -1, 0), 10.0, 10.0, 0.0))
    sync.generate(5.0)
    assert a.get_last_position() == 0
    sync.set_kinematics(a, None)
    sync.generate(6.0)
    with pytest.raises(ValueError, match="oid 9 was not added"):
        sync.set_kinematics(StepCompress(9), first)


def test_move_queue_needs_a_cell():
    with pytest.raises(ValueError, match="not 0"):
        StepperSync(MessageStore(), 0)
