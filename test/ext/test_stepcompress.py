# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps handed to the compressor against what the mcu makes of the messages."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_oracle import find_runs
from motion_rig import QUEUE_STEP, SET_DIR, decode, run_firmware

from klippy_ext.stepcompress import StepCompress
from klippy_ext.steppersync import MessageStore, StepperSync

FREQ, ERROR = 1e6, 25


class Feed:
    """A compressor with clocks instead of times (1 tick is 1 us)."""

    def __init__(self, max_error=ERROR, invert=False):
        self.sc = StepCompress(5)
        self.sc.configure(max_error, QUEUE_STEP, SET_DIR, invert)
        self.store = MessageStore()
        self.sync = StepperSync(self.store, 100000)
        self.sync.add(self.sc)
        self.sync.set_time(0.0, FREQ)
        self.invert, self.commands = invert, []

    def push(self, clocks, direction=1):
        self.sc.push(np.asarray(clocks, dtype=float) / FREQ, direction)
        self.sc.check()

    def flush(self, clock=1 << 62, clear=0):
        self.sync.flush(clock, clear)
        self.sync.check()
        new = decode(self.store.take())
        self.commands += new
        return new

    def steps(self, start_clock=0):
        return run_firmware(self.commands, start_clock, self.invert)


@st.composite
def gap_lists(draw):
    """Times between steps: even, wild, bent, in any order."""
    gaps = []
    for _ in range(draw(st.integers(1, 6))):
        count = draw(st.integers(1, 400))
        kind = draw(st.sampled_from(["even", "wild", "bent"]))
        first = draw(st.integers(1, 20000))
        if kind == "even":
            gaps += [first] * count
        elif kind == "bent":
            last = draw(st.integers(1, 20000))
            gaps += np.linspace(first, last, count).astype(int).tolist()
        else:
            seed = draw(st.integers(0, 1000))
            gaps += np.random.default_rng(seed).integers(1, first + 1, count).tolist()
    return gaps


@settings(max_examples=120, deadline=None)
@given(gap_lists(), st.sampled_from([0, 1, 25, 4500]), st.sampled_from([1, 100, 3000]),
       st.booleans())
def test_every_step_is_within_its_bound(gaps, max_error, batch, with_flushes):
    feed = Feed(max_error)
    clocks = 100 + np.cumsum(gaps)
    for i in range(0, len(clocks), batch):
        feed.push(clocks[i:i + batch])
        if with_flushes and batch > 1:
            feed.flush(int(clocks[i]))
    feed.flush()
    made, directions = feed.steps()
    assert len(made) == len(clocks) and np.all(directions == 1)
    assert np.all(np.diff(made) > 0)
    # each has a half of the way to its neighbours at most
    gaps = np.diff(clocks, prepend=0)
    room = (np.minimum(gaps, np.append(gaps[1:], 10 ** 9)) - 1) // 2
    # where a flush cut a run the neighbour was not known yet
    bound = max_error if with_flushes else np.minimum(room, max_error)
    assert np.all(np.abs(made - clocks) <= bound)
    assert [c[0] for c in feed.commands].count("dir") == 1


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 30), st.integers(51, 4000),
                          st.sampled_from([-1, 1])), min_size=1, max_size=20))
def test_turns(parts):
    """One direction message where the direction turns, none elsewhere."""
    feed, clock, wanted, directions = Feed(), 0, [], []
    for count, gap, direction in parts:
        clocks = clock + gap * np.arange(1, count + 1)
        feed.push(clocks, direction)
        clock = int(clocks[-1])
        wanted += clocks.tolist()
        directions += [direction] * count
    feed.flush()
    made, turned = feed.steps()
    assert np.array_equal(turned, directions)
    assert np.all(np.abs(made - wanted) <= ERROR) and np.all(np.diff(made) > 0)
    changes = 1 + int(np.count_nonzero(np.diff(directions)))
    assert [c[0] for c in feed.commands].count("dir") == changes
    assert feed.sc.get_last_position() == sum(directions)
    assert feed.sc.get_counts()[0] == len(wanted)


@settings(max_examples=60, deadline=None)
@given(gap_lists(), st.lists(st.integers(0, 10 ** 7), min_size=1, max_size=30))
def test_past_position_is_that_of_the_mcu(gaps, queries):
    feed, clocks = Feed(), np.cumsum(gaps)
    half = len(clocks) // 2
    feed.push(clocks[:half])
    feed.push(clocks[half:] + 100, -1)
    feed.flush()
    made, directions = feed.steps()
    for clock in [*queries, *made[:20].tolist(), *(made[-20:] - 1).tolist()]:
        position = int(np.sum(directions[made <= clock]))
        assert feed.sc.find_past_position(clock) == position


def test_messages_of_even_steps():
    feed = Feed()
    feed.push(1000 * np.arange(1, 70001))
    feed.flush()
    assert feed.commands[0][:2] == ("dir", [5, 1])
    assert [c[1] for c in feed.commands[1:]] == [[5, 1000, 65535, 0],
                                                 [5, 1000, 4465, 0]]
    assert feed.commands[1][3] == 1000 and feed.commands[2][3] == 65536000


def test_inverted_direction():
    feed = Feed(invert=True)
    feed.push([1000, 2000])
    feed.push([3000], -1)
    feed.flush()
    assert [c[1][1] for c in feed.commands if c[0] == "dir"] == [0, 1]
    assert feed.steps()[1].tolist() == [1, 1, -1]


def test_new_sense_of_direction_is_told():
    feed = Feed()
    feed.push([1000, 2000])
    feed.flush()
    feed.sc.configure(ERROR, QUEUE_STEP, SET_DIR, False)
    feed.push([3000])
    assert [c[0] for c in feed.flush()] == ["step"]
    feed.sc.configure(ERROR, QUEUE_STEP, SET_DIR, True)
    feed.push([4000])
    new = feed.flush()
    assert [c[0] for c in new] == ["dir", "step"] and new[0][1][1] == 0


def test_opposite_steps_close_by_cancel_out():
    feed = Feed()
    feed.push([10000])
    feed.push([20000])
    feed.push([20050], -1)
    feed.push([30000])
    feed.flush()
    made, directions = feed.steps()
    assert directions.tolist() == [1, 1] and np.all(np.abs(made - [10000, 30000]) <= 25)
    assert feed.sc.get_last_position() == 2


def test_opposite_steps_further_apart_stay():
    feed = Feed()
    feed.push([20000])
    feed.push([20051], -1)
    feed.flush()
    assert feed.steps()[1].tolist() == [1, -1]


def test_steps_at_one_time_keep_their_order():
    feed = Feed()
    feed.push([5000] * 5)
    feed.flush()
    assert feed.steps()[0].tolist() == [5000, 5001, 5002, 5003, 5004]


@pytest.mark.parametrize("gap", [1 << 30, (1 << 32) - 1, 1 << 32, (1 << 32) + 1,
                                 3 << 32, 10 ** 12])
def test_long_rests(gap):
    feed = Feed()
    wanted = [1000, 1000 + gap, 1500 + gap, 1500 + 2 * gap]
    feed.push(wanted)
    feed.flush()
    assert all(c[1][1] > 0 for c in feed.commands if c[0] == "step")
    made = feed.steps()[0]
    assert np.all(np.abs(made - np.array(wanted)) <= ERROR)
    assert feed.sc.find_past_position(900 + gap) == 1
    assert feed.sc.find_past_position(2000 + gap) == 3


def test_slowing_down_so_much_that_add_does_not_fit():
    feed = Feed(0)
    gaps = np.linspace(100, 30_000_000, 700).astype(int)
    clocks = np.cumsum(gaps)
    feed.push(clocks)
    feed.flush()
    assert np.array_equal(feed.steps()[0], clocks)


def test_reset_counts_from_a_clock_and_forgets_the_direction():
    feed = Feed()
    feed.push([1000, 2000])
    feed.flush()
    feed.sc.reset(50000)
    feed.push([51000])
    new = feed.flush()
    assert [c[0] for c in new] == ["dir", "step"]
    assert new[1][1] == [5, 1000, 1, 0] and new[1][3] == 51000


def test_position_is_set_as_after_homing():
    feed = Feed()
    feed.push(1000 * np.arange(1, 101))
    feed.flush()
    # the switch closed at 40500 and the mcu dropped the rest
    assert feed.sc.find_past_position(40500) == 40
    feed.sc.reset(60000)
    feed.sc.set_last_position(60000, 40)
    assert feed.sc.get_last_position() == 40
    assert feed.sc.find_past_position(40500) == 40
    assert feed.sc.find_past_position(60000) == 40
    assert feed.sc.find_past_position(10 ** 9) == 40
    feed.push(70000 + 1000 * np.arange(1, 11), -1)
    feed.flush()
    assert feed.sc.get_last_position() == 30
    assert feed.sc.find_past_position(75500) == 35
    marks = [e for e in feed.sc.extract_old(100, 0, 1 << 60) if not e[3]]
    assert marks == [(60000, 60000, 40, 0, 0, 0)]


def test_messages_go_between_the_steps_around_them():
    feed = Feed()
    feed.push([1000, 2000])
    feed.sc.queue_message(b"\x63\x01")
    feed.push([3000])
    feed.sc.queue_message(b"\x63\x02", 5000)
    feed.flush()
    assert [(c[0], c[3]) for c in feed.commands] == [
        ("dir", 1000), ("step", 1000), ("other", 2000), ("step", 3000), ("other", 5000)]
    with pytest.raises(ValueError, match="59 bytes, not 60"):
        feed.sc.queue_message(b"x" * 60)
    with pytest.raises(ValueError, match="not 0"):
        feed.sc.queue_message(b"")


def test_old_runs_are_given_newest_first():
    feed = Feed()
    feed.push(1000 * np.arange(1, 11))
    feed.push(20000 + 500 * np.arange(1, 5), -1)
    feed.flush()
    *down, up = feed.sc.extract_old(10, 0, 1 << 60)
    assert up == (1000, 10000, 0, 10, 1000, 0)
    assert down[0][1] == 22000 and sum(e[3] for e in down) == -4
    assert down[-1][2] == 10 and down[0][2] + down[0][3] == 6
    assert feed.sc.extract_old(1, 0, 1 << 60) == down[:1]
    assert feed.sc.extract_old(10, 0, 15000) == [up]
    assert feed.sc.extract_old(0, 0, 1 << 60) == []


def test_history_of_a_long_run_is_bounded():
    feed, draw = Feed(0), np.random.default_rng(3)
    clock = 0
    for _ in range(300):
        clocks = clock + np.cumsum(draw.integers(100, 200, 2000))
        feed.push(clocks)
        clock = int(clocks[-1])
        feed.flush(clock, max(clock - 400_000, 0))
        assert len(feed.sc.extract_old(10 ** 5, 0, 1 << 60)) < 5000
        feed.commands.clear()
    assert feed.sc.get_counts()[0] >= 300 * 2000 - 1
    position = feed.sc.get_last_position()
    assert position == 600000 and feed.sc.find_past_position(clock + 10) >= position - 1


def test_direction_must_be_one():
    with pytest.raises(ValueError, match="not 2"):
        Feed().sc.push(np.array([1.0]), 2)


def ramp_times():
    """Up to 200 mm/s and down again, 80 steps a mm."""
    s = (np.arange(533) + 0.5) / 80.0
    up = np.sqrt(2.0 * s / 3000.0)
    cruise = up[-1] + np.arange(1, 3000) / 16000.0
    return np.concatenate([up, cruise, cruise[-1] + up[-1] + 1e-4 - up[::-1]])


def curve_times():
    """Segments of 0.5 mm in a direction that turns: each at its own speed."""
    speed = 40.0 + 30.0 * np.cos(0.11 * np.arange(200))
    s = np.concatenate([[0.0], np.cumsum(speed * 0.008)])
    levels = (np.arange(int(s[-1] * 80)) + 0.5) / 80.0
    return np.interp(levels, s, 0.008 * np.arange(len(s)))


def corner_times():
    """The same with speeds that jump at random."""
    speed = np.random.default_rng(7).uniform(20.0, 80.0, 120)
    s = np.concatenate([[0.0], np.cumsum(speed * 0.008)])
    levels = (np.arange(int(s[-1] * 80)) + 0.5) / 80.0
    return np.interp(levels, s, 0.008 * np.arange(len(s)))


def arm_times():
    """A delta's carriage, up to the top of its way."""
    at = np.linspace(0.0, 0.8, 100001)
    height = np.sqrt(250.0 ** 2 - (80.0 - 100.0 * at) ** 2)
    return np.interp(np.arange(height[0] + 0.01, height[-1] - 0.1, 0.01), height, at)


@pytest.mark.parametrize("freq", [16e6, 180e6])
@pytest.mark.parametrize("times, slack", [(ramp_times, 1.0), (arm_times, 1.0),
                                          (curve_times, 1.04), (corner_times, 1.04)])
def test_no_more_messages_than_with_the_longest_runs(times, slack, freq):
    feed = Feed(int(25e-6 * freq))
    feed.sync.set_time(0.0, freq)
    feed.sc.push(1.0 + times(), 1)
    feed.sc.note_made(10.0)
    feed.flush()
    wanted = np.floor((1.0 + times()) * freq + 0.5).astype(np.int64)
    made = feed.steps()[0]
    assert len(made) == len(wanted) and np.abs(made - wanted).max() <= 25e-6 * freq
    plain = find_runs(wanted, 0, int(25e-6 * freq))
    assert feed.sc.get_counts()[1] <= slack * len(plain)
