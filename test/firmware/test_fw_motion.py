# SPDX-License-Identifier: GPL-3.0-or-later
"""Steppers, endstops and triggers of the firmware, edge by edge."""

import random

import pytest

STEP, DIR, SWITCH = 1, 2, 9
PULSE = 40
TIMEOUT_REASON, HIT_REASON = 4, 1


def stepper(oid=0, invert=0, pulse=PULSE, step=STEP, dir=DIR):
    return ("config_stepper", dict(oid=oid, step_pin=step, dir_pin=dir,
                                   invert_step=invert, step_pulse_ticks=pulse))


@pytest.fixture
def moving(board):
    """A board with one stepper whose clock starts 10000 ticks ahead."""
    board.configure(stepper(), ("config_endstop",
                                dict(oid=1, pin=SWITCH, pull_up=1)),
                    ("config_trsync", dict(oid=2)))
    board.origin = board.clock + 10000
    board.send("reset_step_clock", oid=0, clock=board.origin % 2**32)
    return board


def queue(board, interval, count, add=0, oid=0):
    board.send("queue_step", oid=oid, interval=interval, count=count, add=add)


def list_rises(board, pin=STEP):
    return [c for c, level in board.list_edges(pin) if level]


def expect_clocks(origin, runs):
    """Step times by the definition of queue_step."""
    clock, clocks = origin, []
    for interval, count, add in runs:
        for _ in range(count):
            clock += interval
            clocks.append(clock)
            interval += add
    return clocks


def get_position(board, oid=0):
    return board.query("stepper_get_position", "stepper_position",
                       oid=oid)["pos"]


@pytest.mark.parametrize("runs", [
    [(1000, 5, 0)], [(1000, 5, 10)], [(1000, 5, -10)],
    [(5000, 1, 0), (1000, 7, 3), (900, 65535, 0), (200, 3, 30000)],
    [(100000, 2, -32768)],
])
def test_step_clocks_are_exact(moving, runs):
    for run in runs:
        queue(moving, *run)
    moving.run_for(5.)
    expected = expect_clocks(moving.origin, runs)
    assert list_rises(moving) == expected
    falls = [c for c, level in moving.list_edges(STEP)[1:] if not level]
    assert falls == [c + PULSE for c in expected]
    assert get_position(moving) == -len(expected)


def test_random_runs_of_three_steppers(make_board):
    rng = random.Random(1)
    board = make_board((1 << 32) - 400000)
    board.configure(*[stepper(i, step=10 + i, dir=20 + i) for i in range(3)])
    origin = board.clock + 10000
    runs = [[(rng.randint(200, 9000), rng.randint(1, 30), rng.randint(-3, 3))
             for _ in range(60)] for _ in range(3)]
    for oid in range(3):
        board.send("reset_step_clock", oid=oid, clock=origin % 2**32)
        for run in runs[oid]:
            queue(board, *run, oid=oid)
    board.run_for(2.)
    for oid in range(3):
        assert list_rises(board, 10 + oid) == expect_clocks(origin, runs[oid])
    clocks = [c for c, _, _ in board.edges]
    assert clocks == sorted(clocks) and clocks[-1] > 1 << 32


def test_direction_changes_between_runs(moving):
    moving.send("set_next_step_dir", oid=0, dir=1)
    queue(moving, 1000, 3)
    moving.send("set_next_step_dir", oid=0, dir=0)
    moving.send("set_next_step_dir", oid=0, dir=1)
    queue(moving, 1000, 2)
    moving.send("set_next_step_dir", oid=0, dir=0)
    queue(moving, 1000, 4)
    moving.run(moving.origin + 3000)
    assert get_position(moving) == 3
    moving.run_for(.1)
    assert get_position(moving) == 1
    # The pin moves after the last pulse of the run before, not within it.
    assert moving.list_edges(DIR, moving.origin) == [
        (moving.origin + 5000 + PULSE, 0)]


@pytest.mark.parametrize("pulse", [0, 3])
def test_both_edges_toggle_once_a_step(board, pulse):
    board.configure(stepper(invert=-1 % 256, pulse=pulse))
    origin = board.clock + 5000
    board.send("reset_step_clock", oid=0, clock=origin)
    queue(board, 500, 4, 7)
    board.run_for(.1)
    assert board.list_edges(STEP, origin) == [
        (clock, i % 2 == 0) for i, clock in
        enumerate(expect_clocks(origin, [(500, 4, 7)]))]


def test_inverted_step_pin_idles_high(board):
    board.configure(stepper(invert=1))
    assert board.list_edges(STEP) == [(board.clock, 1)]
    board.send("reset_step_clock", oid=0, clock=board.clock + 5000)
    queue(board, 500, 1)
    board.run_for(.1)
    assert [level for _, level in board.list_edges(STEP)] == [1, 0, 1]


def test_pulses_keep_their_length_when_steps_come_too_fast(moving):
    queue(moving, 30, 10)
    moving.run_for(.1)
    edges = moving.list_edges(STEP, moving.origin)
    assert len(edges) == 20
    gaps = [b[0] - a[0] for a, b in zip(edges, edges[1:], strict=False)]
    assert min(gaps) >= PULSE


def test_first_step_in_the_past(moving):
    moving.run_for(.1)
    queue(moving, 100, 1)
    assert moving.find_shutdown() == "Timer too close"


def test_next_run_far_in_the_past(moving):
    queue(moving, 1000, 1)
    queue(moving, -30000 % 2**32, 2)
    moving.run_for(.1)
    assert moving.find_shutdown() == "Stepper too far in past"


def test_edge_rescheduled_in_the_past(simulator_so):
    from simboard import SimBoard
    board = SimBoard(simulator_so)
    board.identify()
    board.configure(stepper(invert=255, pulse=0))
    board.send("reset_step_clock", oid=0, clock=10000)
    queue(board, 1000, 1)
    queue(board, -30000 % 2**32, 2)
    board.run_for(.1)
    assert board.find_shutdown() == "Rescheduled timer in the past"
    assert board.late == [(11000, 30000)]


@pytest.mark.parametrize("count", [0, 0x10000])
def test_zero_count(moving, count):
    queue(moving, 1000, count)
    assert moving.find_shutdown() == "Invalid count parameter"


def test_reset_clock_while_stepping(moving):
    queue(moving, 100000, 3)
    moving.send("reset_step_clock", oid=0, clock=moving.origin)
    assert moving.find_shutdown() == "Can't reset time when stepper active"


def test_move_queue_overflow(moving):
    count = moving.query("get_config", "config")["move_count"]
    for _ in range(count):
        queue(moving, 1 << 20, 1)
    assert moving.find_shutdown() is None
    queue(moving, 1 << 20, 1)
    queue(moving, 1 << 20, 1)
    assert moving.find_shutdown() == "Move queue overflow"


def test_move_queue_is_reused(moving):
    count = moving.query("get_config", "config")["move_count"]
    for _ in range(3):
        for _ in range(count - 10):
            queue(moving, 200, 1)
        moving.run_for(.1)
        moving.send("reset_step_clock", oid=0, clock=moving.clock + 9999)
    assert moving.find_shutdown() is None
    assert get_position(moving) == -3 * (count - 10)


def test_moves_come_back_after_a_shutdown(moving):
    """Cells of runs that were dropped serve again once the shutdown is over."""
    count = moving.query("get_config", "config")["move_count"]
    for _ in range(count // 2):
        queue(moving, 1 << 20, 1)
    moving.send("emergency_stop")
    moving.send("clear_shutdown")
    moving.send("reset_step_clock", oid=0, clock=moving.clock + 9999)
    for _ in range(count):
        queue(moving, 1 << 20, 1)
    assert moving.query("get_config", "config")["is_shutdown"] == 0


def test_old_runs_are_gone_after_a_shutdown(moving):
    for _ in range(2):
        queue(moving, 1000, 100)
    moving.run(moving.origin + 3000)
    moving.send("emergency_stop")
    moving.send("clear_shutdown")
    start = moving.clock + 9999
    moving.send("reset_step_clock", oid=0, clock=start)
    queue(moving, 1000, 3)
    moving.run_for(.1)
    rises = [clock for clock, level in moving.list_edges(STEP, start) if level]
    assert rises == [start + 1000, start + 2000, start + 3000]


def test_shutdown_stops_within_a_pulse(moving):
    queue(moving, 1000, 100)
    moving.run(moving.origin + 3000)
    moving.send("emergency_stop")
    stop = moving.clock
    assert moving.list_edges(STEP)[-1] == (stop, 0)
    n = len(moving.edges)
    moving.run_for(1.)
    assert len(moving.edges) == n
    moving.send("clear_shutdown")
    assert get_position(moving) == -3


def home(board, sample_count=4, report=0.1, timeout=0.25):
    """Arm trigger, stepper and endstop; steps every 1000 ticks."""
    now = board.clock
    board.send("trsync_start", oid=2, report_clock=now + 1000,
               report_ticks=round(report * board.freq),
               expire_reason=TIMEOUT_REASON)
    board.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    board.send("trsync_set_timeout", oid=2,
               clock=now + round(timeout * board.freq))
    board.send("endstop_home", oid=1, clock=board.origin, sample_ticks=300,
               sample_count=sample_count, rest_ticks=2000, pin_value=1,
               trsync_oid=2, trigger_reason=HIT_REASON)
    for _ in range(60):
        queue(board, 1000, 1000)


def read_endstop(board):
    return board.query("endstop_query_state", "endstop_state", oid=1)


def test_homing_stops_at_the_switch(moving):
    hit = moving.origin + 51500
    moving.inputs[SWITCH] = lambda clock: clock >= hit
    home(moving)
    moving.run_for(.2)
    state = read_endstop(moving)
    # The first sample that sees it is the next multiple of the slow rhythm.
    first = moving.origin + 52000
    assert state["homing"] == 0 and state["pin_value"] == 1
    assert state["next_clock"] - 2000 == first
    stop = first + 3 * 300
    assert max(list_rises(moving)) <= stop
    assert get_position(moving) == -((stop - moving.origin) // 1000)
    final = [m for m in moving.list_messages("trsync_state")
             if not m["can_trigger"]]
    assert len(final) == 1 and final[0]["trigger_reason"] == HIT_REASON
    assert final[0]["#clock"] == stop


def test_noise_on_the_switch_is_ignored(moving):
    spike = moving.origin + 10000
    moving.inputs[SWITCH] = lambda clock: spike <= clock < spike + 700
    home(moving)
    moving.run_for(.2)
    assert read_endstop(moving)["homing"] == 1
    assert moving.find_shutdown() is None


def test_steps_after_a_trigger_are_ignored_until_reset(moving):
    moving.inputs[SWITCH] = lambda clock: clock >= moving.origin + 5000
    home(moving)
    moving.run_for(.1)
    position = get_position(moving)
    queue(moving, 1000, 5)
    moving.run_for(.1)
    assert get_position(moving) == position
    moving.send("reset_step_clock", oid=0, clock=moving.clock + 5000)
    moving.send("set_next_step_dir", oid=0, dir=1)
    queue(moving, 1000, 5)
    moving.run_for(.1)
    assert get_position(moving) == position + 5


def test_lost_host_expires(moving):
    moving.inputs[SWITCH] = 0
    home(moving)
    start = moving.clock
    moving.run_for(1.)
    state = moving.list_messages("trsync_state")
    assert [m["can_trigger"] for m in state] == [1, 1, 1, 0]
    assert state[-1]["trigger_reason"] == TIMEOUT_REASON
    assert state[-1]["#clock"] == start + round(.25 * moving.freq)
    assert max(list_rises(moving)) <= state[-1]["#clock"]


def test_timeout_can_be_extended(moving):
    moving.inputs[SWITCH] = 0
    home(moving)
    for _ in range(10):
        moving.run_for(.1)
        moving.send("trsync_set_timeout", oid=2,
                    clock=moving.clock + round(.2 * moving.freq))
    assert all(m["can_trigger"] for m in moving.list_messages("trsync_state"))


def test_host_triggers_and_learns_the_reason(moving):
    moving.inputs[SWITCH] = 0
    home(moving)
    moving.run_for(.05)
    answer = moving.query("trsync_trigger", "trsync_state", oid=2, reason=3)
    assert (answer["can_trigger"], answer["trigger_reason"]) == (0, 3)
    answer = moving.query("trsync_trigger", "trsync_state", oid=2, reason=7)
    assert answer["trigger_reason"] == 3
    n = len(moving.edges)
    moving.run_for(.5)
    assert len(moving.edges) == n


def test_endstop_can_be_stopped(moving):
    moving.inputs[SWITCH] = 0
    home(moving)
    moving.run_for(.05)
    moving.send("endstop_home", oid=1, clock=0, sample_ticks=0, sample_count=0,
                rest_ticks=0, pin_value=0, trsync_oid=0, trigger_reason=0)
    assert read_endstop(moving)["homing"] == 0


def test_signal_twice(moving):
    moving.send("trsync_start", oid=2, report_clock=0, report_ticks=0,
                expire_reason=TIMEOUT_REASON)
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    assert moving.find_shutdown() == \
        "Can't add signal that is already active"
