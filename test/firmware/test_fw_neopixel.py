# SPDX-License-Identifier: GPL-3.0-or-later
"""Neopixel: the pulses as a led sees them."""

import pytest

PIN = 21
NS = 20 / 1000  # ticks
BIT_MAX = round(4000 * NS)
RESET = round(50000 * NS)


def configure(board, size=6):
    board.configure(
        ("config_neopixel", dict(oid=0, pin=PIN, data_size=size,
                                 bit_max_ticks=BIT_MAX,
                                 reset_min_ticks=RESET)),
        ("config_digital_out", dict(oid=1, pin=5, value=0, default_value=0,
                                    max_duration=0)))


def update(board, pos, data):
    board.send("neopixel_update", oid=0, pos=pos, data=data)


def send(board):
    """Transmit; (success, [(rise, high ticks), ...]) of the pulses."""
    n = len(board.list_messages("neopixel_result"))
    start = len(board.list_edges(PIN))
    board.send("neopixel_send", oid=0)
    board.run_for(.01)
    answers = board.list_messages("neopixel_result")[n:]
    assert len(answers) == 1
    edges = board.list_edges(PIN)[start:]
    assert [level for _, level in edges] == [1, 0] * (len(edges) // 2)
    clocks = [clock for clock, _ in edges]
    return answers[0]["success"], [
        (up, down - up) for up, down in zip(clocks[::2], clocks[1::2],
                                            strict=True)]


def decode(pulses):
    """Bytes, as the data sheets tell 0 from 1; checks every length."""
    bits = ""
    for _, ticks in pulses:
        assert 200 * NS <= ticks <= 500 * NS or 650 * NS <= ticks <= 1000 * NS
        bits += "1" if ticks >= 650 * NS else "0"
    return bytes(int(bits[i:i + 8], 2) for i in range(0, len(bits), 8))


def test_bits_and_their_lengths(board):
    configure(board)
    update(board, 0, b"\x00\xff\xa5")
    update(board, 3, b"\x01\x80\x3c")
    success, pulses = send(board)
    assert success == 1
    assert decode(pulses) == b"\x00\xff\xa5\x01\x80\x3c"
    rises = [rise for rise, _ in pulses]
    periods = [b - a for a, b in zip(rises, rises[1:], strict=False)]
    assert set(periods) == {round(1250 * NS)}
    assert {ticks for _, ticks in pulses} == {round(250 * NS), round(750 * NS)}


def test_only_what_was_updated_changes(board):
    configure(board)
    update(board, 0, b"abcdef")
    send(board)
    update(board, 2, b"XY")
    assert decode(send(board)[1]) == b"abXYef"


def test_pause_between_two_transmissions(board):
    configure(board)
    board.send("neopixel_send", oid=0)
    board.send("neopixel_send", oid=0)
    board.run_for(.01)
    assert len(board.list_messages("neopixel_result")) == 2
    clocks = [clock for clock, level in board.list_edges(PIN) if level]
    assert len(clocks) == 2 * 48
    assert clocks[48] - clocks[47] >= RESET + round(1250 * NS)


def test_other_events_come_in_between(board):
    configure(board)
    started = board.clock
    board.send("queue_digital_out", oid=1, clock=started + 2010, on_ticks=1)
    success, pulses = send(board)
    assert success == 1 and len(pulses) == 48
    assert board.list_edges(5, 1) == [(started + 2010, 1)]


def test_a_limit_that_cannot_be_met(board):
    board.configure(("config_neopixel", dict(
        oid=0, pin=PIN, data_size=3, bit_max_ticks=round(1200 * NS),
        reset_min_ticks=RESET)))
    success, pulses = send(board)
    assert success == 0 and len(pulses) == 1


def test_no_leds_at_all(board):
    configure(board, size=0)
    assert send(board) == (1, [])


@pytest.mark.parametrize("pos, data", [
    (0, b"1234567"), (6, b"1"), (5, b"12"), (65535, b"1"), (7, b"")])
def test_update_beyond_the_end(board, pos, data):
    configure(board)
    update(board, 6, b"")
    assert board.find_shutdown() is None
    update(board, pos, data)
    assert board.find_shutdown() == "Invalid neopixel update command"


def test_size_of_32_kib(board):
    board.send("allocate_oids", count=1)
    board.send("config_neopixel", oid=0, pin=PIN, data_size=0x8000,
               bit_max_ticks=BIT_MAX, reset_min_ticks=RESET)
    assert board.find_shutdown() == "Invalid neopixel data_size"
