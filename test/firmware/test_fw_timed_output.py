# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs that must not stay on: limits, cycles, rest and shutdown in detail."""

import pytest

PIN, OTHER = 5, 6
LIMIT = 50000
EXCEEDS = "Scheduled digital out event will exceed max_duration"
MISSED = "Missed scheduling of next digital out event"


def digital(oid=0, pin=PIN, value=0, default=0, limit=LIMIT):
    return ("config_digital_out", dict(oid=oid, pin=pin, value=value,
                                       default_value=default, max_duration=limit))


def pwm(oid=0, pin=PIN, value=0, default=0, limit=LIMIT):
    return ("config_pwm_out", dict(
        oid=oid, pin=pin, cycle_ticks=20000, value=value, default_value=default,
        max_duration=limit))


def queue(board, clock, on_ticks, oid=0):
    board.send("queue_digital_out", oid=oid, clock=clock, on_ticks=on_ticks)


def list_expired(board):
    return [m["oid"] for m in board.list_messages("output_expired")]


@pytest.mark.parametrize("value", [0, 1])
def test_limit_counts_from_the_configuration(board, value):
    board.configure(digital(value=value, default=1 - value))
    board.run(LIMIT - 1)
    assert board.find_shutdown() is None
    board.run(LIMIT)
    assert board.find_shutdown() == MISSED
    assert board.list_edges(PIN) == [(0, value), (LIMIT, 1 - value)]


@pytest.mark.parametrize("value", [0, 1, 9])
def test_no_limit_at_the_default(board, value):
    board.configure(digital(value=value, default=value))
    board.run_for(1.)
    queue(board, board.clock + 1000, 0)
    queue(board, board.clock + 2000, value)
    board.run_for(1.)
    assert board.find_shutdown() is None
    assert board.list_edges(PIN)[-1][1] == (value != 0)


def test_no_limit_means_none(board):
    board.configure(digital(limit=0), pwm(oid=1, pin=OTHER, limit=0))
    queue(board, 1000, 1)
    board.send("queue_pwm_out", oid=1, clock=1000, value=5)
    board.run_for(60.)
    queue(board, board.clock + 1000, 0)
    board.run_for(1.)
    assert board.find_shutdown() is None


@pytest.mark.parametrize("ahead, is_wrong", [(LIMIT, False), (LIMIT + 1, True)])
@pytest.mark.parametrize("is_late", [False, True])
def test_the_last_moment_for_the_next_value(board, ahead, is_wrong, is_late):
    board.configure(digital())
    queue(board, 10000, 1)
    if is_late:
        board.run(30000)
    queue(board, 10000 + ahead, 0)
    board.run_for(.1)
    assert board.find_shutdown() == (EXCEEDS if is_wrong else None)
    if not is_wrong:
        assert board.list_edges(PIN, 1) == [(10000, 1), (60000, 0)]


def test_update_renews_the_limit(board):
    board.configure(digital())
    for _ in range(5):
        board.send("update_digital_out", oid=0, value=1)
        board.run_for(40000 / board.freq)
    assert board.find_shutdown() is None
    board.send("update_digital_out", oid=0, value=0)
    board.run_for(1.)
    assert board.find_shutdown() is None
    start = board.clock
    board.send("update_digital_out", oid=0, value=1)
    board.run(start + LIMIT - 1)
    assert board.find_shutdown() is None
    board.run(start + LIMIT)
    assert board.find_shutdown() == MISSED
    assert board.list_edges(PIN)[-2:] == [(start, 1), (start + LIMIT, 0)]


def test_update_ends_cycles(board):
    board.configure(digital(limit=0))
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=10000)
    queue(board, 1000, 2500)
    board.run(16000)
    board.send("update_digital_out", oid=0, value=0)
    n = len(board.edges)
    board.run_for(.1)
    assert board.edges[n:] == []
    board.send("update_digital_out", oid=0, value=1)
    board.run_for(.1)
    assert board.edges[n + 1:] == []
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=20000)
    assert board.find_shutdown() is None


def test_cycles_have_a_limit_too(board):
    board.configure(digital())
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=20000)
    queue(board, 1000, 15000)
    board.run_for(.1)
    assert board.find_shutdown() == MISSED
    assert board.list_edges(PIN)[-1] == (51000, 0)


@pytest.mark.parametrize("on_ticks, levels", [
    (0, [0]), (1, [1, 0]), (19999, [1, 0]), (20000, [1]), (20001, [1]),
    (0xffffffff, [1])])
def test_ends_of_the_duty(board, on_ticks, levels):
    board.configure(digital(limit=0))
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=20000)
    queue(board, 10000, on_ticks)
    board.run(29999 + 10 * 20000)
    edges = board.list_edges(PIN, 1)
    expected = [] if levels == [0] else [(10000, 1)]
    if len(levels) == 2:
        expected = sorted([(10000 + 20000 * i, 1) for i in range(11)]
                          + [(10000 + 20000 * i + on_ticks, 0) for i in range(11)
                             if 10000 + 20000 * i + on_ticks < board.clock + 1])
    assert edges == expected


def test_without_cycle_anything_but_zero_is_on(board):
    board.configure(digital(limit=0))
    queue(board, 10000, 12345)
    queue(board, 90000, 0)
    board.run_for(.1)
    assert board.list_edges(PIN, 1) == [(10000, 1), (90000, 0)]


def test_a_new_duty_begins_its_own_cycle(board):
    """Long pulses (6400 ticks are 2 * 160 us) and short ones, at any phase."""
    board.configure(digital(limit=0))
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=20000)
    queue(board, 10000, 8000)
    queue(board, 34000, 12000)   # while high
    queue(board, 89000, 500)     # while low
    queue(board, 129000, 8000)
    board.run(160000)
    assert board.list_edges(PIN, 1) == [
        (10000, 1), (18000, 0), (30000, 1),
        (46000, 0), (54000, 1), (66000, 0), (74000, 1), (86000, 0),
        (89000, 1), (89500, 0), (109000, 1), (109500, 0),
        (129000, 1), (137000, 0), (149000, 1), (157000, 0)]


def test_a_full_value_within_a_cycle_ends_it(board):
    board.configure(digital(limit=0))
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=20000)
    queue(board, 10000, 8000)
    queue(board, 35000, 20000)
    queue(board, 75000, 0)
    queue(board, 95000, 8000)
    queue(board, 104000, 0)
    board.run(200000)
    assert board.list_edges(PIN, 1) == [
        (10000, 1), (18000, 0), (30000, 1), (75000, 0), (95000, 1), (103000, 0)]


def test_values_that_come_close(board):
    board.configure(digital(limit=0))
    for i in range(20):
        queue(board, 10000 + 10 * i, 1 - i % 2)
    board.run_for(.1)
    assert board.list_edges(PIN, 1) == [
        (10000 + 10 * i, 1 - i % 2) for i in range(20)]


def test_values_that_join_those_that_wait(board):
    board.configure(digital(limit=0))
    for i in range(3):
        queue(board, 20000 * (i + 1), 1 - i % 2)
    for i in range(3, 9):
        board.run(20000 * (i - 2) + 9000)
        queue(board, 20000 * (i + 1), 1 - i % 2)
    board.run_for(.1)
    assert board.list_edges(PIN, 1) == [
        (20000 * (i + 1), 1 - i % 2) for i in range(9)]


def test_each_expiry_is_told_once(board):
    board.configure(digital(), pwm(oid=1, pin=OTHER), digital(oid=2, pin=7),
                    pwm(oid=3, pin=8))
    for name, oid in (("digital", 0), ("pwm", 1), ("digital", 2), ("pwm", 3)):
        board.send("rest_%s_out" % name, oid=oid)
    queue(board, 10000, 1)
    board.send("queue_pwm_out", oid=1, clock=20000, value=5)
    board.run_for(.01)
    queue(board, board.clock + 1000, 1, oid=2)
    board.send("queue_pwm_out", oid=3, clock=board.clock + 2000, value=5)
    board.run_for(.01)
    assert list_expired(board) == [0, 1, 2, 3]
    assert board.find_shutdown() is None


def test_expired_outputs_may_be_used_and_expire_again(board):
    board.configure(digital(), pwm(oid=1, pin=OTHER, default=7))
    board.send("rest_digital_out", oid=0)
    board.send("rest_pwm_out", oid=1)
    for _ in range(3):
        queue(board, board.clock + 1000, 1)
        board.send("queue_pwm_out", oid=1, clock=board.clock + 1000, value=5)
        board.run_for(.01)
    assert sorted(list_expired(board)) == [0] * 3 + [1] * 3
    assert board.pwm[-1][3] == 7 and board.list_edges(PIN)[-1][1] == 0
    assert board.find_shutdown() is None


def test_an_expired_output_with_default_on(board):
    board.configure(digital(value=1, default=1))
    board.send("rest_digital_out", oid=0)
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=20000)
    queue(board, 10000, 0)
    board.run_for(.1)
    assert board.list_edges(PIN, 1) == [(10000, 0), (60000, 1)]
    assert list_expired(board) == [0]


def test_a_value_that_comes_too_late_rests_the_output_first(board):
    """Its limit would end before the next value: it rests until that comes."""
    board.configure(pwm())
    board.send("rest_pwm_out", oid=0)
    board.send("queue_pwm_out", oid=0, clock=10000, value=5)
    board.send("queue_pwm_out", oid=0, clock=60001, value=0)
    board.run(60000)
    assert board.pwm[-1][3] == 0
    board.run_for(.1)
    assert board.find_shutdown() is None and list_expired(board) == [0]


def test_hardware_pwm_limits(board):
    board.configure(pwm(default=100, value=100))
    board.run_for(.1)
    board.send("queue_pwm_out", oid=0, clock=board.clock + 1000, value=99)
    first = board.clock + 1000
    board.send("queue_pwm_out", oid=0, clock=first + LIMIT, value=100)
    board.run_for(.1)
    assert board.find_shutdown() is None
    assert [(c, v) for c, _, _, v, _ in board.pwm] == [
        (0, 100), (first, 99), (first + LIMIT, 100)]


def test_hardware_pwm_that_starts_away_from_its_default(board):
    board.configure(pwm(default=100, value=5))
    board.run(LIMIT)
    assert board.find_shutdown() == "Missed scheduling of next hard pwm event"
    assert [(c, v) for c, _, _, v, _ in board.pwm] == [(0, 5), (LIMIT, 100)]


def test_pwm_pin_without_object(board):
    board.send("set_pwm_out", pin=9, cycle_ticks=1234, value=77)
    assert board.pwm == [(board.clock, 9, 1234, 77, 32768)]


@pytest.mark.parametrize("oid", [0, 19])
def test_after_a_shutdown_all_begins_anew(board, oid):
    """Queues are forgotten, cycles end, limits are off, and all can be used."""
    board.configure(digital(oid=oid), pwm(oid=7, pin=OTHER, default=3))
    board.send("set_digital_out_pwm_cycle", oid=oid, cycle_ticks=20000)
    queue(board, 10000, 9000, oid=oid)
    queue(board, 40000, 1, oid=oid)
    board.send("queue_pwm_out", oid=7, clock=12000, value=9)
    board.send("queue_pwm_out", oid=7, clock=42000, value=9)
    board.run(15000)
    board.send("emergency_stop")
    board.send("clear_shutdown")
    assert board.list_edges(PIN)[-1] == (15000, 0)
    assert board.pwm[-1][0] == 15000 and board.pwm[-1][3] == 3
    n_edges, n_pwm = len(board.edges), len(board.pwm)
    board.run_for(.1)
    assert board.edges[n_edges:] == [] and board.pwm[n_pwm:] == []
    start = board.clock
    board.send("set_digital_out_pwm_cycle", oid=oid, cycle_ticks=10000)
    queue(board, start + 1000, 2500, oid=oid)
    queue(board, start + 13000, 0, oid=oid)
    board.send("queue_pwm_out", oid=7, clock=start + 1000, value=9)
    board.send("queue_pwm_out", oid=7, clock=start + 2000, value=3)
    board.run_for(.1)
    assert [(c - start, lv) for c, _, lv in board.edges[n_edges:]] == [
        (1000, 1), (3500, 0), (11000, 1), (13000, 0)]
    assert [(c - start, v) for c, _, _, v, _ in board.pwm[n_pwm:]] == [
        (1000, 9), (2000, 3)]
    assert len(board.list_messages("shutdown")) == 1


def test_queue_cells_come_back(board):
    board.configure(digital(limit=0))
    count = board.query("get_config", "config")["move_count"]
    for _ in range(3):
        for i in range(count):
            queue(board, board.clock + 1000 + 10 * i, i & 1)
        board.run_for(.1)
    assert board.find_shutdown() is None


# ---- Analog inputs ----

def analog(board, oid=0, pin=30, **values):
    board.send("query_analog_in", **{**dict(
        oid=oid, clock=board.clock + 10000, sample_ticks=100, sample_count=2,
        rest_ticks=20000, bytes_per_report=2, min_value=0, max_value=0xffff,
        range_check_count=0), **values})


def list_values(board, start=0):
    return [m["values"] for m in board.list_messages("analog_in_state", start)]


def test_bounds_are_good_readings(board):
    board.configure(("config_analog_in", dict(oid=0, pin=30)))
    board.analog[30] = lambda clock: 0x1000 if clock // 20000 % 2 else 0x2000
    analog(board, min_value=2 * 256, max_value=2 * 512, range_check_count=1)
    board.run_for(.1)
    assert board.find_shutdown() is None and len(list_values(board)) > 50


@pytest.mark.parametrize("low, high", [(513, 0xffff), (0, 511)])
def test_beyond_a_bound_is_not(board, low, high):
    board.configure(("config_analog_in", dict(oid=0, pin=30)))
    board.analog[30] = 0x1000  # two samples of 256
    analog(board, min_value=low, max_value=high, range_check_count=3)
    board.run(10000 + 2 * 20000)
    assert board.find_shutdown() is None
    board.run_for(.01)
    assert board.find_shutdown() == "ADC out of range"
    assert list_values(board)[:2] == [b"\x00\x02"] * 2


def test_a_good_reading_starts_the_count_again(board):
    board.configure(("config_analog_in", dict(oid=0, pin=30)))
    readings = iter([9, 9, 1, 9, 9, 1] + [9] * 50)
    board.analog[30] = lambda clock: next(readings) << 4
    analog(board, sample_count=1, max_value=5, range_check_count=3)
    board.run(10000 + 7 * 20000 + 15000)
    assert board.find_shutdown() is None
    board.run_for(.001)
    assert board.find_shutdown() == "ADC out of range"


def test_a_new_query_starts_from_nothing(board):
    board.configure(("config_analog_in", dict(oid=0, pin=30)),
                    ("config_analog_in", dict(oid=1, pin=31)))
    board.analog[30] = board.analog[31] = 0x100  # 16
    analog(board, oid=1, bytes_per_report=48)
    analog(board, sample_count=200, sample_ticks=90)
    board.run(board.clock + 10000 + 50 * 90)     # in the middle of a reading
    analog(board, sample_count=2, bytes_per_report=4)
    n = len(board.messages)
    board.run(board.clock + 10000 + 25000)
    assert [m["values"] for m in board.list_messages("analog_in_state", n)
            if m["oid"] == 0] == [b"\x20\0\x20\0"]
    assert board.list_messages("analog_in_state", n)[0]["next_clock"] == \
        14500 + 10000 + 2 * 20000


def test_every_input_reports_by_itself(board):
    for oid in (0, 1, 19):
        board.analog[30 + oid] = (oid + 1) << 4
    board.configure(*[("config_analog_in", dict(oid=oid, pin=30 + oid))
                      for oid in (0, 1, 19)])
    for oid, size in ((0, 2), (1, 4), (19, 48)):
        analog(board, oid=oid, bytes_per_report=size, sample_count=1)
    board.run(10000 + 23 * 20000 + 10000)
    for oid, size, count in ((0, 2, 24), (1, 4, 12), (19, 48, 1)):
        mine = [m["values"] for m in board.list_messages("analog_in_state")
                if m["oid"] == oid]
        assert mine == [bytes([oid + 1, 0]) * (size // 2)] * count


def test_shutdown_ends_all_readings(board):
    board.configure(("config_analog_in", dict(oid=0, pin=30)))
    analog(board, bytes_per_report=8)
    board.run(60000)
    board.send("emergency_stop")
    board.send("clear_shutdown")
    board.run_for(.1)
    assert list_values(board) == []
    analog(board, bytes_per_report=8)
    start = board.clock
    board.run(start + 10000 + 2 * 20000 + 15000)
    assert list_values(board) == []
    board.run(start + 10000 + 4 * 20000)
    assert len(list_values(board)) == 1
