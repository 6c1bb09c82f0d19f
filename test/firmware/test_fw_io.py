# SPDX-License-Identifier: GPL-3.0-or-later
"""Digital, pwm and analog pins of the firmware."""

import struct

import pytest

PIN = 5


def digital(value=0, default=0, max_duration=0):
    return ("config_digital_out",
            dict(oid=0, pin=PIN, value=value, default_value=default,
                 max_duration=max_duration))


def queue(board, clock, on_ticks):
    board.send("queue_digital_out", oid=0, clock=clock, on_ticks=on_ticks)


def test_digital_out_at_its_clock(board):
    board.configure(digital(value=1))
    assert board.list_edges(PIN) == [(0, 1)]
    queue(board, 5000, 0)
    queue(board, 7000, 1)
    queue(board, 7500, 0)
    board.run_for(.01)
    assert board.list_edges(PIN) == [(0, 1), (5000, 0), (7000, 1), (7500, 0)]


def test_soft_pwm_duty(board):
    board.configure(digital())
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=1000)
    queue(board, 10000, 250)
    queue(board, 13000, 900)
    queue(board, 15000, 1000)
    queue(board, 20000, 0)
    board.run_for(.01)
    assert board.list_edges(PIN, 1) == [
        (10000, 1), (10250, 0), (11000, 1), (11250, 0), (12000, 1), (12250, 0),
        (13000, 1), (13900, 0), (14000, 1), (14900, 0), (15000, 1), (20000, 0)]


def test_cycle_cannot_change_while_busy(board):
    board.configure(digital())
    queue(board, 10000, 1)
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=1000)
    assert board.find_shutdown() == \
        "Can not set soft pwm cycle ticks while updates pending"


def test_max_duration_expires(board):
    board.configure(digital(max_duration=50000))
    queue(board, 10000, 1)
    board.run_for(.01)
    assert board.find_shutdown() == \
        "Missed scheduling of next digital out event"
    assert board.list_edges(PIN, 1) == [(10000, 1), (60000, 0)]


def rest(board, value=0):
    board.configure(digital(value, value, max_duration=50000))
    board.send("rest_digital_out", oid=0)


def list_expired(board):
    return board.list_messages("output_expired")


def test_a_resting_output_expires_without_shutdown(board):
    rest(board)
    queue(board, 10000, 1)
    board.run_for(.1)
    assert board.list_edges(PIN, 1) == [(10000, 1), (60000, 0)]
    assert board.find_shutdown() is None and len(list_expired(board)) == 1
    # and it can be used again
    again = board.clock + 10000
    queue(board, again, 1)
    queue(board, again + 9000, 0)
    board.run_for(.1)
    assert board.list_edges(PIN, 1)[2:] == [(again, 1), (again + 9000, 0)]
    assert board.find_shutdown() is None and len(list_expired(board)) == 1


def test_a_resting_output_with_cycles_expires(board):
    rest(board)
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=20000)
    queue(board, 10000, 15000)
    board.run_for(.1)
    assert board.list_edges(PIN, 1) == [
        (10000, 1), (25000, 0), (30000, 1), (45000, 0), (50000, 1), (60000, 0)]
    assert board.find_shutdown() is None and len(list_expired(board)) == 1


@pytest.mark.parametrize("is_late", [False, True])
def test_a_resting_output_does_not_wait_for_a_late_value(board, is_late):
    """It rests at once if the value will come after the limit."""
    rest(board)
    queue(board, 10000, 1)
    board.run(20000 if is_late else 0)
    queue(board, 70000, 1)
    queue(board, 80000, 0)
    board.run_for(.1)
    edges = board.list_edges(PIN, 1)
    assert edges[0] == (10000, 1) and edges[2:] == [(70000, 1), (80000, 0)]
    assert 10000 <= edges[1][0] < 60000 and edges[1][1] == 0
    assert board.find_shutdown() is None and len(list_expired(board)) == 1


def test_max_duration_is_renewed_and_ends_at_default(board):
    board.configure(digital(max_duration=50000))
    for i in range(5):
        queue(board, 10000 + 40000 * i, 1)
    queue(board, 220000, 0)
    board.run_for(1.)
    assert board.find_shutdown() is None
    assert board.list_edges(PIN, 1) == [(10000, 1), (220000, 0)]


@pytest.mark.parametrize("is_late", [False, True])
def test_event_beyond_max_duration(board, is_late):
    board.configure(digital(max_duration=50000))
    queue(board, 10000, 1)
    board.run(20000 if is_late else 0)
    queue(board, 60001, 0)
    board.run_for(.01)
    assert board.find_shutdown() == \
        "Scheduled digital out event will exceed max_duration"


def test_shutdown_restores_the_default_at_once(board):
    board.configure(digital(value=0, default=1), ("config_pwm_out", dict(
        oid=1, pin=6, cycle_ticks=20000, value=0, default_value=777,
        max_duration=0)))
    board.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=1000)
    queue(board, 10000, 250)
    board.run(20500)
    board.send("emergency_stop")
    assert board.list_edges(PIN)[-1] == (20500, 1)
    assert board.pwm[-1] == (20500, 6, 20000, 777, 32768)
    n = len(board.edges)
    board.run_for(1.)
    assert len(board.edges) == n


def test_update_now(board):
    board.configure(digital())
    board.send("update_digital_out", oid=0, value=1)
    assert board.list_edges(PIN)[-1] == (board.clock, 1)
    queue(board, 9000, 0)
    board.send("update_digital_out", oid=0, value=1)
    assert board.find_shutdown() == \
        "update_digital_out not valid with active queue"


def test_pin_without_object(board):
    board.send("set_digital_out", pin=77, value=1)
    assert board.list_edges(77) == [(board.clock, 1)]


@pytest.mark.parametrize("name, values, reason", [
    ("set_digital_out", dict(pin=256, value=1), "Not an output pin"),
    ("config_endstop", dict(oid=0, pin=3, pull_up=9), "Not a valid input pin"),
    ("config_analog_in", dict(oid=0, pin=256), "Not a valid ADC pin"),
    ("set_pwm_out", dict(pin=999, cycle_ticks=1, value=1),
     "Not a valid PWM pin"),
])
def test_pins_that_do_not_exist(board, name, values, reason):
    board.send("allocate_oids", count=1)
    board.send(name, **values)
    assert board.find_shutdown() == reason


def test_hardware_pwm(board):
    board.configure(("config_pwm_out", dict(
        oid=1, pin=6, cycle_ticks=20000, value=100, default_value=0,
        max_duration=1000000)))
    board.send("queue_pwm_out", oid=1, clock=5000, value=16384)
    board.send("queue_pwm_out", oid=1, clock=9000, value=40000)
    board.run_for(1.)
    assert board.pwm == [
        (0, 6, 20000, 100, 32768), (5000, 6, 20000, 16384, 32768),
        (9000, 6, 20000, 32768, 32768), (1009000, 6, 20000, 0, 32768)]
    assert board.find_shutdown() == "Missed scheduling of next hard pwm event"


def test_resting_hardware_pwm(board):
    board.configure(("config_pwm_out", dict(
        oid=1, pin=6, cycle_ticks=20000, value=0, default_value=0,
        max_duration=100000)))
    board.send("rest_pwm_out", oid=1)
    board.send("queue_pwm_out", oid=1, clock=5000, value=16384)
    board.run_for(.1)
    assert board.pwm == [(0, 6, 20000, 0, 32768), (5000, 6, 20000, 16384, 32768),
                         (105000, 6, 20000, 0, 32768)]
    assert board.find_shutdown() is None and len(list_expired(board)) == 1


def analog(board, *, count=4, per_report=2, low=0, high=0xffff, bad=0):
    board.configure(("config_analog_in", dict(oid=0, pin=30)))
    board.send("query_analog_in", oid=0, clock=10000, sample_ticks=100,
               sample_count=count, rest_ticks=20000,
               bytes_per_report=per_report, min_value=low, max_value=high,
               range_check_count=bad)


def test_analog_reading_is_a_sum(board):
    board.analog[30] = lambda clock: 0x8000 if clock < 25000 else 0xffff
    analog(board)
    board.run(10000 + 300)
    first = board.list_messages("analog_in_state")[0]
    assert first["next_clock"] == 30000
    assert struct.unpack("<H", first["values"]) == (2048 * 4,)
    board.run(30000 + 300)
    second = board.list_messages("analog_in_state")[1]
    assert struct.unpack("<H", second["values"]) == (4095 * 4,)
    assert second["next_clock"] == 50000


def test_analog_batches(board):
    board.analog[30] = lambda clock: clock // 10000 << 4
    analog(board, count=1, per_report=6)
    board.run(10000 + 20000 * 6 - 1)
    reports = board.list_messages("analog_in_state")
    values = [struct.unpack("<3H", m["values"]) for m in reports]
    assert values == [(1, 3, 5), (7, 9, 11)]
    assert [m["next_clock"] for m in reports] == [70000, 130000]


def test_analog_out_of_range(board):
    board.analog[30] = lambda clock: 0xffff if clock > 50000 else 0x8000
    analog(board, high=10000, bad=3)
    board.run_for(.01)
    assert board.find_shutdown() == "ADC out of range"
    shutdown = board.list_messages("shutdown")[0]
    # Readings start at 50000, 70000, 90000; the last has four samples.
    assert shutdown["clock"] == 90000 + 3 * 100


def test_analog_range_needs_bad_readings_in_a_row(board):
    board.analog[30] = lambda clock: 0 if clock // 20000 % 3 else 0x8000
    analog(board, low=1000, bad=3)
    board.run_for(.1)
    assert board.find_shutdown() is None


def test_analog_stops(board):
    analog(board)
    board.run_for(.01)
    board.send("query_analog_in", oid=0, clock=0, sample_ticks=0,
               sample_count=0, rest_ticks=0, bytes_per_report=0, min_value=0,
               max_value=0, range_check_count=0)
    n = len(board.messages)
    board.run_for(1.)
    assert board.list_messages("analog_in_state", n) == []


@pytest.mark.parametrize("size", [0, 3, 50])
def test_analog_report_size(board, size):
    analog(board, per_report=size)
    assert board.find_shutdown() == "Invalid analog_in bytes_per_report"


def test_temperature_pin(board):
    pin = board.dictionary["enumerations"]["pin"]["ADC_TEMPERATURE"]
    board.configure(("config_analog_in", dict(oid=0, pin=pin)))
    assert board.find_shutdown() is None
