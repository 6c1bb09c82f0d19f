# SPDX-License-Identifier: GPL-3.0-or-later
"""Triggers and steppers in the order of things that is less usual."""

import pytest

STEP, DIR, SWITCH = 1, 2, 9


def stepper(invert=0, pulse=40, oid=0, step=STEP):
    return ("config_stepper", dict(oid=oid, step_pin=step, dir_pin=DIR,
                                   invert_step=invert, step_pulse_ticks=pulse))


@pytest.fixture
def moving(board):
    """Stepper 0, endstop 1, triggers 0, 2 and 3 of which 2 is armed."""
    board.configure(stepper(), ("config_endstop", dict(oid=1, pin=SWITCH, pull_up=1)),
                    ("config_trsync", dict(oid=2)), ("config_trsync", dict(oid=3)))
    start(board, 2)
    board.send("reset_step_clock", oid=0, clock=board.clock + 10000)
    board.origin = board.clock + 10000
    return board


def start(board, oid, report=0, reason=4):
    board.send("trsync_start", oid=oid, report_clock=board.clock + 1000,
               report_ticks=report, expire_reason=reason)


def queue(board, interval, count, add=0, oid=0):
    board.send("queue_step", oid=oid, interval=interval, count=count, add=add)


def count_rises(board, pin=STEP):
    return sum(level for _, level in board.list_edges(pin))


def get_position(board, oid=0):
    return board.query("stepper_get_position", "stepper_position", oid=oid)["pos"]


def list_states(board, start=0):
    return [(m["oid"], m["can_trigger"], m["trigger_reason"])
            for m in board.list_messages("trsync_state", start)]


def test_who_comes_late_is_stopped_at_once(moving):
    """The trigger has fired before the stepper asks to be stopped by it."""
    queue(moving, 10000, 100)
    moving.run(moving.origin + 25000)
    moving.send("trsync_trigger", oid=2, reason=1)
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    moving.run_for(.1)
    assert count_rises(moving) == 2 and get_position(moving) == -2
    queue(moving, 100, 5)
    moving.run_for(.1)
    assert count_rises(moving) == 2


def test_runs_for_a_stopped_stepper_take_no_room(moving):
    """What is sent until the host hears of the stop is dropped, not kept."""
    moving.send("trsync_trigger", oid=2, reason=1)
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    for _ in range(moving.query("get_config", "config")["move_count"] + 9):
        queue(moving, 1000, 1)
    assert moving.find_shutdown() is None and get_position(moving) == 0


def test_a_stopped_stepper_can_be_stopped_again(moving):
    for i in range(3):
        start(moving, 2)
        moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
        moving.send("reset_step_clock", oid=0, clock=moving.clock + 1000)
        queue(moving, 1000, 100)
        moving.run_for(5500 / moving.freq)
        moving.send("trsync_trigger", oid=2, reason=1)
        assert get_position(moving) == -4 * (i + 1)
    assert moving.find_shutdown() is None


def test_start_again_forgets_who_was_to_be_stopped(moving):
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    start(moving, 2)
    queue(moving, 1000, 10)
    moving.send("trsync_trigger", oid=2, reason=1)
    moving.run_for(.1)
    assert count_rises(moving) == 10
    start(moving, 2)
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    assert moving.find_shutdown() is None


def test_several_are_stopped_by_one_trigger(board):
    board.configure(*[stepper(oid=i, step=20 + i) for i in range(3)],
                    ("config_trsync", dict(oid=3)))
    start(board, 3)
    for oid in range(3):
        board.send("stepper_stop_on_trigger", oid=oid, trsync_oid=3)
        board.send("reset_step_clock", oid=oid, clock=board.clock + 1000)
        queue(board, 1000, 50, oid=oid)
    board.run(3500 + board.clock)
    board.send("trsync_trigger", oid=3, reason=1)
    board.run_for(.1)
    assert [count_rises(board, 20 + i) for i in range(3)] == [2, 2, 2]
    # and each of them may be given to a trigger again
    start(board, 3)
    for oid in range(3):
        board.send("stepper_stop_on_trigger", oid=oid, trsync_oid=3)
    assert board.find_shutdown() is None


def test_a_stop_disturbs_nobody_else(board):
    """The timer that was the first is gone: the next one is not early."""
    board.configure(stepper(), stepper(oid=1, step=20), ("config_trsync", dict(oid=2)))
    start(board, 2)
    board.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    for oid, interval in ((0, 1000), (1, 7000)):
        board.send("reset_step_clock", oid=oid, clock=10000)
        queue(board, interval, 10, oid=oid)
    board.run(13500)
    board.send("trsync_trigger", oid=2, reason=1)
    board.run_for(.1)
    assert [c for c, level in board.list_edges(20) if level] == [
        10000 + 7000 * (i + 1) for i in range(10)]
    assert get_position(board) == -3


def test_a_trigger_of_each_number(board):
    """Reports, timeouts and shutdowns reach objects from 0 to the last."""
    board.configure(*[("config_trsync", dict(oid=oid)) for oid in (0, 1, 19)])
    for oid in (0, 1, 19):
        start(board, oid, report=5000, reason=oid + 7)
        board.send("trsync_set_timeout", oid=oid, clock=board.clock + 8000)
    board.run_for(.01)
    assert sorted(list_states(board)) == sorted(
        [(oid, 1, 0) for oid in (0, 1, 19) for _ in range(2)]
        + [(oid, 0, oid + 7) for oid in (0, 1, 19)])
    assert [m["#clock"] for m in board.list_messages("trsync_state")] == [
        1000] * 3 + [6000] * 3 + [8000] * 3


def test_reports_tell_the_clock_and_end_with_the_trigger(moving):
    start(moving, 3, report=1000)
    moving.run_for(3500 / moving.freq)
    reports = moving.list_messages("trsync_state")
    assert [(m["clock"], m["#clock"]) for m in reports] == [
        (t, t) for t in (1000, 2000, 3000)]
    answer = moving.query("trsync_trigger", "trsync_state", oid=3, reason=2)
    assert (answer["can_trigger"], answer["clock"]) == (0, 0)
    n = len(moving.messages)
    moving.run_for(.1)
    assert list_states(moving, n) == []


def test_no_reports_without_an_interval(moving):
    moving.run_for(.1)
    assert list_states(moving) == []


def test_timeout_of_a_trigger_that_is_not_armed(moving):
    moving.send("trsync_set_timeout", oid=3, clock=moving.clock + 1000)
    moving.run_for(.1)
    assert list_states(moving) == []
    moving.send("trsync_trigger", oid=2, reason=1)
    n = len(moving.messages)
    moving.send("trsync_set_timeout", oid=2, clock=moving.clock + 1000)
    moving.run_for(.1)
    assert list_states(moving, n) == []


def test_start_forgets_an_earlier_timeout_and_reason(moving):
    moving.send("trsync_set_timeout", oid=2, clock=moving.clock + 5000)
    moving.send("trsync_trigger", oid=2, reason=9)
    start(moving, 2, report=20000)
    moving.run_for(6000 / moving.freq)
    assert list_states(moving)[1:] == [(2, 1, 0)]


def test_timeout_while_the_trigger_is_told(moving):
    """Both at one clock: the first reason counts, and is told once."""
    moving.send("trsync_set_timeout", oid=2, clock=moving.clock + 1000)
    moving.run_for(.001)
    assert list_states(moving) == [(2, 0, 4)]
    moving.send("trsync_trigger", oid=2, reason=8)
    assert list_states(moving) == [(2, 0, 4), (2, 0, 4)]


def test_shutdown_disarms(moving):
    start(moving, 3, report=1000)
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    moving.send("trsync_set_timeout", oid=2, clock=moving.clock + 5000)
    moving.send("emergency_stop")
    n = len(moving.messages)
    moving.run_for(.1)
    assert list_states(moving, n) == []
    moving.send("clear_shutdown")
    assert moving.query("trsync_trigger", "trsync_state", oid=2,
                        reason=6)["trigger_reason"] == 0
    start(moving, 2)
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    moving.send("reset_step_clock", oid=0, clock=moving.clock + 1000)
    queue(moving, 100, 3)
    moving.run_for(.1)
    assert moving.find_shutdown() == "Command request"
    assert count_rises(moving) == 3


# ---- Endstops ----

def home(board, **values):
    board.send("endstop_home", **{**dict(
        oid=1, clock=board.clock + 1000, sample_ticks=100, sample_count=3,
        rest_ticks=1000, pin_value=1, trsync_oid=2, trigger_reason=1), **values})


def read_endstop(board):
    return board.query("endstop_query_state", "endstop_state", oid=1)


@pytest.mark.parametrize("pin_value", [0, 1, 5])
def test_level_of_the_endstop(moving, pin_value):
    hit = moving.clock + 3000
    moving.inputs[SWITCH] = lambda clock: (clock >= hit) == (pin_value != 0)
    start(moving, 2)
    home(moving, pin_value=pin_value)
    moving.run(hit - 1)
    assert read_endstop(moving)["homing"] == 1
    moving.run(hit + 199)
    assert read_endstop(moving)["homing"] == 1
    moving.run(hit + 200)
    state = read_endstop(moving)
    assert (state["homing"], state["pin_value"]) == (0, pin_value != 0)
    assert list_states(moving) == [(2, 0, 1)]


def test_one_sample_is_enough_if_told_so(moving):
    moving.inputs[SWITCH] = lambda clock: clock == 4000
    home(moving, sample_count=1)
    moving.run(3999)
    assert list_states(moving) == []
    moving.run(4000)
    assert list_states(moving) == [(2, 0, 1)]


def test_a_bounce_starts_the_count_again(moving):
    """Pressed for two of three samples, then for good."""
    levels = {1000: 1, 1100: 1, 1200: 0}
    moving.inputs[SWITCH] = lambda clock: levels.get(clock, clock >= 2000)
    home(moving)
    moving.run(2199)
    state = read_endstop(moving)
    assert (state["homing"], state["next_clock"]) == (1, 3000)
    moving.run(2200)
    assert list_states(moving) == [(2, 0, 1)]


def test_homing_can_be_ended_and_begun_again(moving):
    moving.inputs[SWITCH] = 0
    home(moving)
    moving.run(2500)
    home(moving, sample_count=0)
    assert read_endstop(moving)["homing"] == 0
    moving.inputs[SWITCH] = 1
    moving.run_for(.01)
    assert list_states(moving) == []
    home(moving)
    moving.run_for(.01)
    assert list_states(moving) == [(2, 0, 1)]
    home(moving)  # nobody is armed: it ends without a word
    moving.run_for(.01)
    assert read_endstop(moving)["homing"] == 0
    assert list_states(moving) == [(2, 0, 1)]


def test_shutdown_ends_homing(moving):
    moving.inputs[SWITCH] = 0
    home(moving)
    moving.send("emergency_stop")
    moving.send("clear_shutdown")
    assert read_endstop(moving)["homing"] == 0


def test_pull_up_is_passed_on(make_board):
    for pull in (0, 1, 255):
        board = make_board()
        board.configure(("config_endstop", dict(oid=1, pin=SWITCH, pull_up=pull)))
        assert read_endstop(board)["pin_value"] == (pull == 1)


# ---- Steppers ----

@pytest.mark.parametrize("pulse", [0, 1, 3, 4])
def test_short_pulses_are_pulses(board, pulse):
    """Only a driver that is told to steps on both edges."""
    board.configure(stepper(pulse=pulse))
    board.send("reset_step_clock", oid=0, clock=5000)
    queue(board, 500, 3)
    board.run_for(.1)
    rises = [5500, 6000, 6500]
    width = max(pulse, 1)
    assert board.list_edges(STEP, 1) == sorted(
        [(c, 1) for c in rises] + [(c + width, 0) for c in rises])


@pytest.mark.parametrize("pulse, is_checked", [(3, False), (4, True), (200, True)])
def test_both_edges_with_long_pauses_keep_them(board, pulse, is_checked):
    board.configure(stepper(invert=255, pulse=pulse))
    board.send("reset_step_clock", oid=0, clock=5000)
    queue(board, 2 if not is_checked else pulse // 2, 6)
    board.run_for(.1)
    clocks = [c for c, _ in board.list_edges(STEP, 1)]
    gaps = {b - a for a, b in zip(clocks, clocks[1:], strict=False)}
    assert len(clocks) == 6 and gaps == {pulse if is_checked else 2}
    assert get_position(board) == -6


@pytest.mark.parametrize("invert, idle", [(0, 0), (1, 1), (2, 1), (127, 1)])
def test_stop_within_a_pulse_ends_it(board, invert, idle):
    board.configure(stepper(invert=invert, pulse=1000),
                    ("config_trsync", dict(oid=2)))
    start(board, 2)
    board.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    board.send("reset_step_clock", oid=0, clock=5000)
    queue(board, 5000, 3)
    board.run(15500)
    assert get_position(board) == -2
    board.send("trsync_trigger", oid=2, reason=1)
    assert board.list_edges(STEP)[-1] == (15500, idle)
    assert get_position(board) == -2
    board.run_for(.1)
    assert get_position(board) == -2
    # afterwards pulses begin as they should
    board.send("reset_step_clock", oid=0, clock=board.clock)
    queue(board, 5000, 1)
    n = len(board.edges)
    board.run_for(.1)
    assert [level for _, _, level in board.edges[n:]] == [1 - idle, idle]
    assert get_position(board) == -3


def test_stop_leaves_both_edges_alone(board):
    board.configure(stepper(invert=255, pulse=0), ("config_trsync", dict(oid=2)))
    start(board, 2)
    board.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    board.send("reset_step_clock", oid=0, clock=5000)
    queue(board, 5000, 3)
    board.run(10500)
    board.send("trsync_trigger", oid=2, reason=1)
    board.run_for(.1)
    assert board.list_edges(STEP, 1) == [(10000, 1)]
    assert get_position(board) == -1


def test_direction_after_a_stop_is_that_of_the_pin(moving):
    """What was queued in another direction is forgotten with its direction."""
    moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    moving.send("set_next_step_dir", oid=0, dir=1)
    queue(moving, 1000, 3)
    moving.send("set_next_step_dir", oid=0, dir=0)
    queue(moving, 1000, 3)
    moving.run(moving.origin + 2500)
    moving.send("trsync_trigger", oid=2, reason=1)
    assert get_position(moving) == 2
    moving.send("reset_step_clock", oid=0, clock=moving.clock + 1000)
    queue(moving, 1000, 2)
    moving.run_for(.1)
    assert get_position(moving) == 4
    moving.send("set_next_step_dir", oid=0, dir=7)
    moving.send("reset_step_clock", oid=0, clock=moving.clock + 1000)
    queue(moving, 1000, 2)
    moving.run_for(.1)
    assert get_position(moving) == 6


def test_runs_dropped_by_a_stop_can_be_used_again(moving):
    count = moving.query("get_config", "config")["move_count"]
    for _ in range(3):
        start(moving, 2)
        moving.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
        moving.send("reset_step_clock", oid=0, clock=moving.clock + 99999)
        for _ in range(count // 2):
            queue(moving, 1 << 20, 1)
        moving.send("trsync_trigger", oid=2, reason=1)
        for _ in range(10):
            queue(moving, 1, 1)  # ignored, and given back
    assert moving.find_shutdown() is None
    assert get_position(moving) == 0


def test_a_shutdown_keeps_the_position_of_each(board):
    board.configure(*[stepper(oid=i, step=20 + i) for i in range(2)])
    for oid in range(2):
        board.send("set_next_step_dir", oid=oid, dir=oid)
        board.send("reset_step_clock", oid=oid, clock=5000)
        queue(board, 1000, 3, oid=oid)
        queue(board, 1000, 30, oid=oid)
    board.run(10020)
    board.send("emergency_stop")
    board.send("clear_shutdown")
    assert [get_position(board, oid) for oid in range(2)] == [-5, 5]
    for oid in range(2):
        queue(board, 100, 5, oid=oid)  # needs a new clock first
    board.run_for(.1)
    assert [get_position(board, oid) for oid in range(2)] == [-5, 5]


def test_how_late_a_step_may_be(make_board):
    """Behind by a millisecond steps are made up for, by more they are not."""
    for ticks, is_late in ((20000, False), (20050, True)):
        board = make_board()
        board.configure(stepper())
        board.send("reset_step_clock", oid=0, clock=5000)
        queue(board, 1000, 1)
        # as seen when the pulse of the first step ends
        queue(board, (40 - ticks) % 2**32, 1)
        board.run_for(.1)
        assert (board.find_shutdown() == "Stepper too far in past") == is_late
        assert count_rises(board) == (1 if is_late else 2)
