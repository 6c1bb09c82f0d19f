# SPDX-License-Identifier: GPL-3.0-or-later
"""Displays on plain pins: what the display reads, and when."""

import pytest

US = 20
BUSY = 40 * US


class Hd44780:
    """Reads a nibble at each falling edge of E."""

    RS, E = 100, 101
    DATA = (102, 103, 104, 105)

    def __init__(self, board):
        self.board, self.nibbles, self.clocks = board, [], []
        self.rise = 0
        board.watchers[self.E] = self.note_enable

    def level(self, pin):
        return self.board.list_edges(pin)[-1][1]

    def note_enable(self, clock, level):
        if level:
            self.rise = clock
        elif self.rise:
            assert clock - self.rise >= .45 * US
            changes = [self.board.list_edges(pin)[-1][0]
                       for pin in (*self.DATA, self.RS)]
            assert max(changes) <= self.rise
            bits = [self.level(pin) for pin in self.DATA]
            self.nibbles.append(sum(b << i for i, b in enumerate(bits)))
            self.clocks.append((clock, self.level(self.RS)))

    def list_bytes(self):
        return bytes(high << 4 | low for high, low in zip(
            self.nibbles[::2], self.nibbles[1::2], strict=True))


def configure_hd44780(board):
    display = Hd44780(board)
    board.configure(("config_hd44780", dict(
        oid=0, rs_pin=100, e_pin=101, d4_pin=102, d5_pin=103, d6_pin=104,
        d7_pin=105, delay_ticks=BUSY)), board.configure_shutdown_at(1, 200))
    return display


def test_hd44780_bytes(board):
    display = configure_hd44780(board)
    board.send("hd44780_send_cmds", oid=0, cmds=b"\x33\x32\x28\x80")
    board.send("hd44780_send_data", oid=0, data=b"\xa5\x0fHi")
    board.run_for(.01)
    assert display.list_bytes() == b"\x33\x32\x28\x80\xa5\x0fHi"
    assert [rs for _, rs in display.clocks] == [0] * 8 + [1] * 8
    ends = [clock for clock, _ in display.clocks[1::2]]
    assert all(b - a >= BUSY for a, b in zip(ends, ends[1:], strict=False))
    assert ends[-1] - ends[0] < 8 * (BUSY + 3 * US)


def test_hd44780_needs_no_pause_after_a_long_one(board):
    display = configure_hd44780(board)
    board.run(100 * BUSY)
    board.send("hd44780_send_cmds", oid=0, cmds=b"\x01")
    board.run_for(.01)
    assert display.clocks[0][0] <= 100 * BUSY + 2 * US


def test_hd44780_shutdown(board):
    display = configure_hd44780(board)
    board.send("hd44780_send_data", oid=0, data=b"12")
    board.run_for(.01)
    again = board.clock + 100 * BUSY
    board.run(again)
    board.shutdown_at(1, again + 105)
    board.send("hd44780_send_data", oid=0, data=bytes(40))
    board.run_for(.1)
    assert board.find_shutdown() is not None
    assert 4 <= len(display.nibbles) < 20
    assert display.level(display.E) == 0


class St7920:
    """Reads a bit at each rising edge of the clock while selected."""

    CS, SCLK, SID = 110, 111, 112

    def __init__(self, board):
        self.board, self.runs, self.clocks = board, [], []
        self.selected = False
        board.watchers[self.CS] = self.note_select
        board.watchers[self.SCLK] = self.note_clock

    def note_select(self, clock, level):
        if level:
            self.bits, self.last = "", clock
            self.clocks.append([])
        elif self.selected:
            self.runs.append(bytes(int(self.bits[i:i + 8], 2)
                                   for i in range(0, len(self.bits), 8)))
        self.selected = level

    def note_clock(self, clock, level):
        if not self.selected:
            return
        assert clock - self.last >= .2 * US
        self.last = clock
        if level:
            assert clock - self.board.list_edges(self.SID)[-1][0] >= .1 * US
            self.bits += str(self.board.list_edges(self.SID)[-1][1])
            self.clocks[-1].append(clock)


def configure_st7920(board):
    display = St7920(board)
    board.configure(("config_st7920", dict(
        oid=0, cs_pin=110, sclk_pin=111, sid_pin=112,
        sync_delay_ticks=20 * US, cmd_delay_ticks=BUSY)),
        board.configure_shutdown_at(1, 200))
    return display


def test_st7920_bytes(board):
    display = configure_st7920(board)
    board.send("st7920_send_cmds", oid=0, cmds=b"\x36\x80")
    board.send("st7920_send_data", oid=0, data=b"\xa5\xff\x01")
    board.run_for(.01)
    assert display.runs == [
        bytes([0xf8, 0x30, 0x60, 0x80, 0x00]),
        bytes([0xfa, 0xa0, 0x50, 0xf0, 0xf0, 0x00, 0x10])]
    assert not display.selected


def test_st7920_pauses(board):
    display = configure_st7920(board)
    board.send("st7920_send_cmds", oid=0, cmds=b"\x36\x80")
    board.send("st7920_send_data", oid=0, data=b"\xa5")
    board.run_for(.01)
    first, second = display.clocks
    assert first[8] - first[7] >= 20 * US          # after sync
    assert first[24] - first[23] >= BUSY           # between two bytes
    assert second[8] - first[39] >= BUSY           # between two runs
    assert first[16] - first[15] < 2 * US          # within a byte


def test_st7920_shutdown(board):
    display = configure_st7920(board)
    board.shutdown_at(1, 10 * BUSY)
    board.send("st7920_send_data", oid=0, data=bytes(40))
    board.run_for(.1)
    assert board.find_shutdown() is not None
    assert len(display.clocks[0]) < 200
    assert not display.selected
    board.send("clear_shutdown")
    board.send("st7920_send_data", oid=0, data=b"\x12")
    board.run_for(.1)
    assert display.runs[-1] == b"\xfa\x10\x20"


@pytest.mark.parametrize("name, values", [
    ("config_hd44780", dict(rs_pin=1, e_pin=2, d4_pin=3, d5_pin=4, d6_pin=5,
                            d7_pin=999, delay_ticks=1)),
    ("config_st7920", dict(cs_pin=1, sclk_pin=2, sid_pin=999,
                           sync_delay_ticks=1, cmd_delay_ticks=1))])
def test_what_cannot_be(make_board, name, values):
    board = make_board()
    board.send("allocate_oids", count=1)
    board.send(name, oid=0, **values)
    assert board.find_shutdown() == "Not an output pin"
    board = make_board()
    board.send("allocate_oids", count=1)
    board.send("config_trsync", oid=0)
    values = {key: min(value, 9) for key, value in values.items()}
    board.send(name, oid=0, **values)
    assert board.find_shutdown() == "Can't assign oid"
