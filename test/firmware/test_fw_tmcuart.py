# SPDX-License-Identifier: GPL-3.0-or-later
"""The UART of stepper drivers: bits on the wire, replies, timeouts."""

import pytest

BIT = 500  # ticks: 40000 baud at 20 MHz
RX, TX = 60, 61
READ_REQUEST = bytes([0x05, 0x00, 0x06, 0x6f])


def to_bits(data):
    """Levels on the wire: start bit, eight bits, stop bit of each byte."""
    return [level for byte in data
            for level in [0, *((byte >> i) & 1 for i in range(8)), 1]]


def pack(data):
    """The same in bytes, as the host hands it over."""
    bits = to_bits(data)
    return bytes(sum(bit << i for i, bit in enumerate(bits[pos:pos + 8]))
                 for pos in range(0, len(bits), 8))


class Wire:
    """One line with a driver that answers at `reply_at` (ticks)."""

    def __init__(self, board, pin):
        self.levels, self.reply_at, self.bit = [], None, BIT
        board.inputs[pin] = self.read

    def reply(self, data, clock, bit=BIT, gap=0):
        """gap: idle bits after each byte."""
        self.levels = []
        for i in range(len(data)):
            self.levels += to_bits(data[i:i + 1]) + [1] * gap
        self.reply_at, self.bit = clock, bit

    def read(self, clock):
        if self.reply_at is None or clock < self.reply_at:
            return 1
        n = int((clock - self.reply_at) / self.bit)
        return self.levels[n] if n < len(self.levels) else 1


def configure(board, rx=RX, tx=TX):
    board.configure(("config_tmcuart", dict(
        oid=0, rx_pin=rx, pull_up=1, tx_pin=tx, bit_time=BIT)))
    return Wire(board, rx)


def send(board, data, read=0):
    board.send("tmcuart_send", oid=0, write=pack(data), read=read)


def list_levels(board, pin, start):
    """Levels in the middle of each bit from `start` to the last edge's."""
    edges = board.list_edges(pin)
    levels = []
    clock = start + BIT // 2
    while clock < edges[-1][0] + BIT:
        levels.append([lv for c, lv in edges if c <= clock][-1])
        clock += BIT
    return levels


def list_answers(board):
    return [m["read"] for m in board.list_messages("tmcuart_response")]


@pytest.mark.parametrize("rx", [RX, TX])
def test_bits_on_the_wire(board, rx):
    configure(board, rx)
    assert board.list_edges(TX) == [(0, 1)]
    data = bytes([0x05, 0xff, 0x00, 0x25])
    send(board, data)
    board.run_for(.01)
    edges = board.list_edges(TX, 1)
    start = edges[0][0]
    assert {(clock - start) % BIT for clock, _ in edges} == {0}
    bits = to_bits(data)
    assert list_levels(board, TX, start) == bits
    # The stop bit has its whole length before the answer.
    answer = board.list_messages("tmcuart_response")[0]
    assert answer["read"] == b""
    assert answer["#clock"] == start + BIT * len(bits)


@pytest.mark.parametrize("rx", [RX, TX])
@pytest.mark.parametrize("delay", [8, 8.3, 24.1, 119.9])
@pytest.mark.parametrize("speed", [.97, 1, 1.03])
def test_reply(board, rx, delay, speed):
    """Any phase, and a driver whose clock is off by 3 %."""
    wire = configure(board, rx)
    send(board, READ_REQUEST, read=10)
    end = (12 + len(to_bits(READ_REQUEST))) * BIT
    reply = bytes([0x05, 0xff, 0x06, 0x21, 0x00, 0x00, 0x40, 0x9b])
    wire.reply(reply, end + delay * BIT, BIT * speed)
    board.run_for(.1)
    assert list_answers(board) == [pack(reply)]
    assert board.list_edges(TX)[-1][1] == 1


def test_reply_with_pauses(board):
    wire = configure(board)
    send(board, READ_REQUEST, read=10)
    wire.reply(b"abcdefgh", 70 * BIT, gap=3)
    board.run_for(.1)
    assert list_answers(board) == [pack(b"abcdefgh")]


def test_no_reply(board):
    configure(board)
    send(board, READ_REQUEST, read=10)
    board.run_for(.1)
    assert list_answers(board) == [b""]
    waited = board.list_messages("tmcuart_response")[0]["#clock"]
    assert 120 * BIT < waited - 53 * BIT < 170 * BIT


def test_a_reply_that_breaks_off(board):
    wire = configure(board)
    send(board, READ_REQUEST, read=10)
    wire.reply(b"abc", 70 * BIT)
    board.run_for(.1)
    assert list_answers(board) == [b""]
    send(board, READ_REQUEST, read=10)
    wire.reply(b"abcdefgh", board.clock + 70 * BIT)
    board.run_for(.1)
    assert list_answers(board) == [b"", pack(b"abcdefgh")]


def test_a_line_that_is_stuck_low_still_ends(board):
    configure(board)
    board.inputs[RX] = 0
    send(board, READ_REQUEST, read=10)
    board.run_for(.1)
    assert list_answers(board) == [bytes(10)]


def test_one_pin_is_released_only_while_it_reads(board):
    wire = configure(board, TX)
    seen = []
    board.inputs[TX] = lambda clock: seen.append(clock) or wire.read(clock)
    send(board, READ_REQUEST, read=10)
    wire.reply(b"abcdefgh", 70 * BIT)
    board.run_for(.1)
    start = board.list_edges(TX, 1)[0][0]
    assert min(seen) >= start + 40 * BIT
    assert list_answers(board) == [pack(b"abcdefgh")]


def test_a_command_that_comes_too_soon_is_dropped(board):
    wire = configure(board)
    send(board, READ_REQUEST, read=10)
    wire.reply(b"abcdefgh", 70 * BIT)
    for clock in range(0, 150 * BIT, 10 * BIT):
        board.run(clock)
        send(board, b"\xff\xff\xff\xff")
    board.run(151 * BIT)
    assert list_answers(board) == [pack(b"abcdefgh")]
    start = board.list_edges(TX, 1)[0][0]
    assert list_levels(board, TX, start) == to_bits(READ_REQUEST)


def test_the_line_rests_between_two_datagrams(board):
    configure(board)
    send(board, b"\x55" * 8)
    board.run_for(.01)
    assert len(list_answers(board)) == 1
    board.clock = end = board.clock
    send(board, b"\x55" * 8)
    board.run(end + 3 * BIT)
    assert board.list_edges(TX, end)[0] == (end + BIT, 0)
    board.run(board.clock + 90 * BIT)
    done = board.list_messages("tmcuart_response")[-1]["#clock"]
    board.run(done + 1)
    send(board, b"\x55" * 8)
    board.run_for(.01)
    gap = board.list_edges(TX, done)[0][0] - done
    assert gap >= 1


def test_shutdown_leaves_the_line_high(board):
    configure(board, TX)
    send(board, b"\x00" * 8)
    start = board.clock + 12 * BIT
    board.run(start + 3 * BIT)
    assert board.list_edges(TX)[-1][1] == 0
    board.send("emergency_stop")
    assert board.list_edges(TX)[-1] == (board.clock, 1)
    board.run_for(.1)
    assert list_answers(board) == []
    board.send("clear_shutdown")
    send(board, b"\x00")
    board.run_for(.1)
    assert list_answers(board) == [b""]


@pytest.mark.parametrize("size, read", [(11, 0), (0, 11), (40, 255)])
def test_too_much_data(board, size, read):
    configure(board)
    board.send("tmcuart_send", oid=0, write=bytes(size), read=read)
    assert board.find_shutdown() == "tmcuart data too large"


@pytest.mark.parametrize("values, reason", [
    (dict(oid=0, rx_pin=300, pull_up=1, tx_pin=1, bit_time=9),
     "Not a valid input pin"),
    (dict(oid=0, rx_pin=3, pull_up=1, tx_pin=300, bit_time=9),
     "Not an output pin"),
    (dict(oid=9, rx_pin=3, pull_up=1, tx_pin=3, bit_time=9),
     "Can't assign oid"),
])
def test_what_cannot_be(board, values, reason):
    board.send("allocate_oids", count=2)
    board.send("config_tmcuart", **values)
    assert board.find_shutdown() == reason
