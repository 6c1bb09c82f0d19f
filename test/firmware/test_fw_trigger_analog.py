# SPDX-License-Identifier: GPL-3.0-or-later
"""Triggers on readings of an analog input, and their filter."""

import random

import pytest

PIN = 30
READ = 1000      # ticks from one reading to the next
FIRST = 10000    # clock of the first reading
FRAC = 28
TRIGGER, ERROR = 3, 10


def setup(board, values, sections=0):
    """values: of the readings, 0..4095, the last one for ever."""
    def level(clock):
        return values[min((clock - FIRST) // READ, len(values) - 1)] << 4

    board.analog[PIN] = level
    board.configure(
        ("config_trsync", dict(oid=0)),
        ("config_sos_filter", dict(oid=1, max_sections=sections)),
        ("config_trigger_analog", dict(oid=2, sos_filter_oid=1)),
        ("config_analog_in", dict(oid=3, pin=PIN)),
        ("config_stepper", dict(oid=4, step_pin=1, dir_pin=2, invert_step=0,
                                step_pulse_ticks=20)),
        ("analog_in_attach_trigger_analog", dict(
            oid=3, trigger_analog_oid=2)))
    board.send("query_analog_in", oid=3, clock=FIRST, sample_ticks=0,
               sample_count=1, rest_ticks=READ, bytes_per_report=2,
               min_value=0, max_value=65535, range_check_count=0)


def home(board, kind="gt", value=100, clock=FIRST, ticks=0, most=0):
    number = board.dictionary["enumerations"]["trigger_analog_type"][kind]
    board.send("trigger_analog_set_trigger", oid=2,
               trigger_analog_type=number, trigger_value=value)
    board.send("trsync_start", oid=0, report_clock=0, report_ticks=0,
               expire_reason=9)
    board.send("stepper_stop_on_trigger", oid=4, trsync_oid=0)
    board.send("trigger_analog_home", oid=2, trsync_oid=0,
               trigger_reason=TRIGGER, error_reason=ERROR, clock=clock,
               monitor_ticks=ticks, monitor_max=most)


def find_trigger(board):
    """(clock of the message, reason), None while nothing has triggered."""
    found = [m for m in board.list_messages("trsync_state")
             if not m["can_trigger"]]
    return (found[0]["#clock"], found[0]["trigger_reason"]) if found else None


def query(board):
    state = board.query("trigger_analog_query_state", "trigger_analog_state",
                        oid=2)
    return state["homing"], state["homing_clock"]


def nth(n):
    return FIRST + n * READ


def error(board, name):
    return ERROR + board.dictionary["enumerations"][
        "trigger_analog_error:"][name]


def test_greater_than(board):
    setup(board, [0, 50, 99, 100, 101, 5])
    home(board, "gt", 100)
    board.run(nth(3))
    assert find_trigger(board) is None
    assert query(board)[0] == 1
    board.run(nth(9))
    assert find_trigger(board) == (nth(4), TRIGGER)
    assert query(board) == (0, nth(4))


def test_absolute_value_of_a_tared_reading(board):
    setup(board, [2000, 2099, 1901, 1900, 2000])
    board.send("sos_filter_set_offset_scale", oid=1, offset=-2000, scale=1,
               scale_frac_bits=0, auto_offset=0)
    home(board, "abs_ge", 100)
    board.run(nth(9))
    assert find_trigger(board) == (nth(3), TRIGGER)


def test_first_reading_becomes_zero(board):
    setup(board, [1234, 1300, 1333, 1334, 1335])
    board.send("sos_filter_set_offset_scale", oid=1, offset=777, scale=1,
               scale_frac_bits=0, auto_offset=1)
    home(board, "gt", 100)
    board.run(nth(9))
    assert find_trigger(board) == (nth(4), TRIGGER)


def test_fall_from_the_peak(board):
    setup(board, [500, 600, 700, 690, 710, 640, 611, 609, 800])
    home(board, "diff_peak_gt", 100)
    board.run(nth(9))
    assert find_trigger(board) == (nth(7), TRIGGER)
    # The host wants to know when the peak was.
    assert query(board) == (0, nth(4))


def test_readings_before_the_start_do_not_trigger(board):
    setup(board, [500, 500, 500, 500, 100, 100, 500])
    home(board, "gt", 200, clock=nth(4) - 1)
    board.run(nth(9))
    assert find_trigger(board) == (nth(6), TRIGGER)


def test_raw_range(board):
    setup(board, [100, 200, 301, 200])
    board.send("trigger_analog_set_raw_range", oid=2, raw_min=100,
               raw_max=300)
    home(board, "gt", 4000)
    board.run(nth(9))
    assert find_trigger(board) == (nth(2), error(board, "RAW_RANGE"))
    assert query(board) == (0, nth(2))


def test_raw_range_below(board):
    setup(board, [100, 200, 99, 200])
    board.send("trigger_analog_set_raw_range", oid=2, raw_min=100,
               raw_max=300)
    home(board, "gt", 4000)
    board.run(nth(9))
    assert find_trigger(board) == (nth(2), error(board, "RAW_RANGE"))


def test_overflow(board):
    setup(board, [100, 200, 2049, 200])
    board.send("sos_filter_set_offset_scale", oid=1, offset=0, scale=1 << 20,
               scale_frac_bits=0, auto_offset=0)
    home(board, "gt", 0x7fffffff)
    board.run(nth(9))
    assert find_trigger(board) == (nth(2), error(board, "OVERFLOW"))


def test_monitor(board):
    setup(board, [100])
    home(board, ticks=READ, most=2)
    board.run(nth(20))
    assert find_trigger(board) is None
    board.send("query_analog_in", oid=3, clock=0, sample_ticks=0,
               sample_count=0, rest_ticks=0, bytes_per_report=0, min_value=0,
               max_value=0, range_check_count=0)
    board.run(nth(30))
    clock, reason = find_trigger(board)
    assert reason == error(board, "MONITOR")
    assert nth(22) <= clock <= nth(23)


def test_end_of_homing(board):
    setup(board, [0, 0, 0, 500])
    home(board, ticks=READ, most=3)
    board.send("trigger_analog_home", oid=2, trsync_oid=0, trigger_reason=0,
               error_reason=0, clock=0, monitor_ticks=0, monitor_max=0)
    board.run(nth(20))
    assert find_trigger(board) is None and query(board)[0] == 0
    board.send("emergency_stop")
    board.run_for(.1)


def test_shutdown_ends_homing(board):
    setup(board, [0])
    home(board, ticks=READ, most=3)
    board.send("emergency_stop")
    board.send("clear_shutdown")
    assert query(board)[0] == 0


def fixed(value):
    return round(value * (1 << FRAC))


def filter_in_python(sections, states, values):
    """The same arithmetic in exact integers."""
    def times(a, b):
        return (a * b + (1 << FRAC - 1)) >> FRAC
    for x in values:
        for coeff, state in zip(sections, states, strict=True):
            y = times(coeff[0], x) + state[0]
            state[0] = times(coeff[1], x) - times(coeff[3], y) + state[1]
            state[1] = times(coeff[2], x) - times(coeff[4], y)
            x = y
        yield x


def send_sections(board, sections, states):
    for i, (coeff, state) in enumerate(zip(sections, states, strict=True)):
        board.send("sos_filter_set_section", oid=1, section_idx=i,
                   **{"sos%d" % n: c for n, c in enumerate(coeff)})
        board.send("sos_filter_set_state", oid=1, section_idx=i,
                   state0=state[0], state1=state[1])
    board.send("sos_filter_set_active", oid=1, n_sections=len(sections),
               coeff_frac_bits=FRAC)


@pytest.mark.parametrize("seed", range(20))
def test_filter_arithmetic(board, seed):
    """The first reading whose filtered value passes a limit, to the last
    bit: limits are values that the filter really takes."""
    rng = random.Random(seed)
    n_sections = rng.randrange(1, 4)
    sections = []
    for _ in range(n_sections):
        pole = rng.uniform(.2, .95)
        sections.append([fixed(v) for v in (
            rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1),
            -2 * pole * rng.uniform(-1, 1), pole * pole)])
    states = [[rng.randrange(-999, 999), rng.randrange(-999, 999)]
              for _ in sections]
    values = [rng.randrange(4096) for _ in range(60)]
    expected = list(filter_in_python(
        sections, [list(state) for state in states], values))
    limit = rng.choice(expected[:50])
    first = next((i for i, y in enumerate(expected) if y > limit), None)
    setup(board, values, sections=n_sections)
    send_sections(board, sections, states)
    home(board, "gt", limit)
    board.run(nth(59))
    found = find_trigger(board)
    assert (found[0] if found else None) == \
        (None if first is None else nth(first))


def test_low_pass_settles_at_the_input(board):
    """A real filter (Butterworth, 2nd order, .1 of Nyquist) as a whole."""
    sections = [[fixed(v) for v in (.0200833655642, .0401667311285,
                                    .0200833655642, -1.5610180758, .641351538)]]
    setup(board, [0] + [3000] * 200, sections=1)
    send_sections(board, sections, [[0, 0]])
    home(board, "gt", 2990)
    board.run(nth(200))
    clock, reason = find_trigger(board)
    assert reason == TRIGGER
    # Its step response passes 99.7 % in the tenth to fourteenth sample.
    assert nth(10) <= clock <= nth(15)


@pytest.mark.parametrize("name, values, reason", [
    ("config_trigger_analog", dict(oid=4, sos_filter_oid=0),
     "Invalid oid type"),
    ("sos_filter_set_section", dict(oid=1, section_idx=2, sos0=0, sos1=0,
                                    sos2=0, sos3=0, sos4=0),
     "Filter section index larger than max_sections"),
    ("sos_filter_set_state", dict(oid=1, section_idx=2, state0=0, state1=0),
     "Filter section index larger than max_sections"),
    ("sos_filter_set_active", dict(oid=1, n_sections=3, coeff_frac_bits=9),
     "Filter section index larger than max_sections"),
    ("sos_filter_set_active", dict(oid=1, n_sections=2, coeff_frac_bits=32),
     "Invalid filter fraction bits"),
    ("sos_filter_set_offset_scale", dict(
        oid=1, offset=0, scale=0, scale_frac_bits=32, auto_offset=0),
     "Invalid filter fraction bits"),
    ("trigger_analog_set_trigger", dict(oid=2, trigger_analog_type=3,
                                        trigger_value=0),
     "Invalid trigger_analog type"),
    ("trigger_analog_home", dict(
        oid=2, trsync_oid=1, trigger_reason=1, error_reason=1, clock=0,
        monitor_ticks=0, monitor_max=0), "Invalid oid type"),
    ("trigger_analog_query_state", dict(oid=1), "Invalid oid type"),
    ("config_sos_filter", dict(oid=2, max_sections=1), "Can't assign oid"),
])
def test_what_cannot_be(board, name, values, reason):
    board.send("allocate_oids", count=5)
    board.send("config_trsync", oid=0)
    board.send("config_sos_filter", oid=1, max_sections=2)
    board.send("config_trigger_analog", oid=2, sos_filter_oid=1)
    board.send(name, **values)
    assert board.find_shutdown() == reason
