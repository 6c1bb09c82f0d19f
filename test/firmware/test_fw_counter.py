# SPDX-License-Identifier: GPL-3.0-or-later
"""Pulse counters."""

PIN = 33
START = 10000
POLL = 100
SAMPLE = 5000


def start(board, source, poll=POLL):
    board.inputs[PIN] = source
    board.configure(("config_counter", dict(oid=2, pin=PIN, pull_up=1)))
    board.send("query_counter", oid=2, clock=START, poll_ticks=poll,
               sample_ticks=SAMPLE)


def list_states(board):
    return [(m["next_clock"], m["count"], m["count_clock"])
            for m in board.list_messages("counter_state")]


def test_both_edges_count(board):
    # Level changes at START + 750 and every 1000 ticks from there.
    start(board, lambda clock: (clock - START + 250) // 1000 % 2)
    board.run(START + 3 * SAMPLE)
    assert list_states(board) == [
        (START + 2 * SAMPLE, 5, START + 4800),
        (START + 3 * SAMPLE, 10, START + 9800),
        (START + 4 * SAMPLE, 15, START + 14800)]
    assert board.list_messages("counter_state")[0]["#clock"] == START + SAMPLE
    assert board.list_messages("counter_state")[0]["oid"] == 2


def test_a_still_pin_counts_nothing(board):
    start(board, lambda clock: 1)
    board.run(START + 2 * SAMPLE)
    assert list_states(board) == [(START + 2 * SAMPLE, 0, START),
                                  (START + 3 * SAMPLE, 0, START)]


def test_stop_and_go_on(board):
    start(board, lambda clock: (clock - START) // 1000 % 2)
    board.run(START + SAMPLE)
    board.send("query_counter", oid=2, clock=0, poll_ticks=0, sample_ticks=0)
    n = len(list_states(board))
    board.run(START + 10 * SAMPLE)
    assert len(list_states(board)) == n
    clock = START + 11 * SAMPLE
    board.send("query_counter", oid=2, clock=clock, poll_ticks=POLL,
               sample_ticks=SAMPLE)
    board.run(clock + SAMPLE)
    # One more than the edges since: the level is another than at the query.
    assert list_states(board)[-1] == (clock + 2 * SAMPLE, 11, clock + 5000)


def test_shutdown_stops(board):
    start(board, lambda clock: clock // 1000 % 2)
    board.run(START + SAMPLE)
    board.send("emergency_stop")
    n = len(list_states(board))
    board.run(START + 10 * SAMPLE)
    assert len(list_states(board)) == n


def test_what_cannot_be(make_board):
    for name, values, reason in [
            ("config_counter", dict(oid=0, pin=256, pull_up=0),
             "Not a valid input pin"),
            ("config_counter", dict(oid=0, pin=1, pull_up=3),
             "Not a valid input pin"),
            ("query_counter", dict(oid=0, clock=0, poll_ticks=1,
                                   sample_ticks=1), "Invalid oid type")]:
        board = make_board()
        board.send("allocate_oids", count=2)
        board.send(name, **values)
        assert board.find_shutdown() == reason
