# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons: debounced, reported until acknowledged."""

import pytest

REST = 1000
START = 10000


def configure(board, pins=(40, 41), invert=0, retransmit=5):
    board.configure(
        ("config_buttons", dict(oid=0, button_count=len(pins))),
        *[("buttons_add", dict(oid=0, pos=i, pin=pin, pull_up=0))
          for i, pin in enumerate(pins)])
    board.send("buttons_query", oid=0, clock=START, rest_ticks=REST,
               retransmit_count=retransmit, invert=invert)


def press(board, pin, *spans):
    """The pin is high in each [first, last] span of clocks."""
    board.inputs[pin] = lambda clock: any(a <= clock <= b for a, b in spans)


def list_states(board):
    return [(m["#clock"], m["ack_count"], list(m["state"]))
            for m in board.list_messages("buttons_state")]


def test_two_equal_polls_make_a_level(board):
    press(board, 40, (START + 3 * REST, START + 4 * REST))
    configure(board)
    board.run(START + 6 * REST)
    # High in polls 3 and 4, low in polls 5 and 6.
    assert list_states(board) == [
        (START + 4 * REST, 0, [1]), (START + 6 * REST, 0, [1, 0])]


def test_a_single_odd_poll_is_noise(board):
    press(board, 40, *[(START + i * REST,) * 2 for i in range(0, 40, 2)])
    press(board, 41, (START + 7 * REST, START + 1000 * REST))
    configure(board, retransmit=100)
    board.run(START + 50 * REST)
    # The noise on the first pin does not delay the second.
    assert list_states(board) == [(START + 8 * REST, 0, [2])]


def test_the_first_report_may_come_from_the_inversion(board):
    configure(board, invert=3)
    board.run(START + REST)
    assert list_states(board) == [(START + REST, 0, [3])]


def test_unacknowledged_reports_are_sent_again(board):
    press(board, 40, (START, START + 100 * REST))
    configure(board, retransmit=5)
    board.run(START + 14 * REST)
    times = [(clock - START) // REST for clock, _, _ in list_states(board)]
    assert times == [1, 6, 11]
    board.send("buttons_ack", oid=0, count=1)
    board.run(START + 40 * REST)
    assert len(list_states(board)) == 3


def test_acknowledged_reports_are_counted_and_dropped(board):
    press(board, 40, (START + 2 * REST, START + 5 * REST),
          (START + 20 * REST, START + 30 * REST))
    configure(board)
    board.run(START + 7 * REST)
    assert list_states(board)[-1][1:] == (0, [1, 0])
    board.send("buttons_ack", oid=0, count=1)
    board.run(START + 15 * REST)
    assert list_states(board)[-1][1:] == (1, [0])
    board.send("buttons_ack", oid=0, count=1)
    board.run(START + 21 * REST)
    assert list_states(board)[-1][1:] == (2, [1])


def test_an_ack_of_too_much_counts_what_there_was(board):
    press(board, 40, (START, START + 9 * REST))
    configure(board)
    board.run(START + REST)
    board.send("buttons_ack", oid=0, count=200)
    board.run(START + 20 * REST)
    assert list_states(board)[-1][1:] == (1, [0])


def test_the_newest_state_survives_a_full_buffer(board):
    spans = [(START + i * REST, START + (i + 1) * REST)
             for i in range(0, 60, 4)]
    press(board, 40, *spans, (START + 70 * REST, START + 1000 * REST))
    configure(board)
    board.run(START + 80 * REST)
    assert list_states(board)[-1][1:] == (0, [1, 0] * 4)
    board.send("buttons_ack", oid=0, count=8)
    board.run(START + 82 * REST)
    assert list_states(board)[-1][1:] == (8, [1])


def test_eight_pins_keep_their_positions(board):
    pins = range(50, 58)
    for i, pin in enumerate(pins):
        press(board, pin, (START + 10 * i * REST, START + 1000 * REST))
    configure(board, pins, retransmit=255)
    board.run(START + 75 * REST)
    assert list_states(board)[-1][2] == [2 ** (i + 1) - 1 for i in range(8)]


def test_a_position_without_a_pin_reads_low(board):
    board.configure(("config_buttons", dict(oid=0, button_count=8)))
    board.send("buttons_query", oid=0, clock=START, rest_ticks=REST,
               retransmit_count=5, invert=0x80)
    board.run(START + REST)
    assert list_states(board)[-1][2] == [0x80]


def test_rest_ticks_zero_stops(board):
    press(board, 40, (START, START + 9 * REST))
    configure(board)
    board.send("buttons_query", oid=0, clock=0, rest_ticks=0,
               retransmit_count=0, invert=0)
    board.run_for(1.)
    assert list_states(board) == []


def test_shutdown_ends_reports_and_a_new_query_begins_anew(board):
    press(board, 40, (START, START + 9000 * REST))
    configure(board)
    board.run(START + 3 * REST)
    board.send("emergency_stop")
    n = len(list_states(board))
    board.run(START + 30 * REST)
    assert len(list_states(board)) == n
    board.send("clear_shutdown")
    board.send("buttons_query", oid=0, clock=START + 40 * REST,
               rest_ticks=REST, retransmit_count=5, invert=0)
    board.run(START + 41 * REST)
    assert list_states(board)[-1][1:] == (0, [1])


@pytest.mark.parametrize("name, values, reason", [
    ("config_buttons", dict(oid=1, button_count=9), "Max of 8 buttons"),
    ("config_buttons", dict(oid=0, button_count=1), "Can't assign oid"),
    ("buttons_add", dict(oid=0, pos=2, pin=1, pull_up=0),
     "Set button past maximum button count"),
    ("buttons_add", dict(oid=1, pos=0, pin=1, pull_up=0), "Invalid oid type"),
    ("buttons_add", dict(oid=0, pos=0, pin=900, pull_up=0),
     "Not a valid input pin"),
    ("buttons_query", dict(oid=0, clock=START, rest_ticks=9,
                           retransmit_count=0, invert=0),
     "Invalid buttons retransmit count"),
    ("buttons_ack", dict(oid=3, count=1), "Invalid oid type"),
])
def test_what_cannot_be(board, name, values, reason):
    board.send("allocate_oids", count=2)
    board.send("config_buttons", oid=0, button_count=2)
    board.send(name, **values)
    assert board.find_shutdown() == reason
