# SPDX-License-Identifier: GPL-3.0-or-later
"""I2C devices: on a bus of the chip, and in software on any pins."""

import pytest

SCL, SDA = 80, 81
PULSE = 100
ADDR = 0x4C


class Device:
    """A device with registers behind a pointer; watches the bus rules."""

    def __init__(self, board):
        self.board = board
        self.log = []           # what the bus saw: S, P, bytes, "+" and "-"
        self.memory = bytearray(range(100, 200))
        self.pointer = 0
        self.stretch = 0        # ticks that each bit takes longer
        self.nack_after = None  # of a write, data bytes
        self.refuses_read = False
        self.scl = self.sda = 1  # as the master drives them
        self.out = 1             # 0: pulled by the device
        self.state, self.ready = None, 0
        self.held = 0            # clocks for which a stuck device holds data
        board.watchers.update({SCL: self.note_scl, SDA: self.note_sda})
        board.inputs[SCL] = lambda clock: clock >= self.ready
        board.inputs[SDA] = lambda clock: self.out and not self.held

    def note_sda(self, clock, level):
        if self.scl and level != self.sda and clock >= self.ready:
            self.log.append("P" if level else "S")
            self.state = None if level else "address"
            self.bits, self.out = [], 1
        self.sda = level

    def note_scl(self, clock, level):
        if level == self.scl:
            return
        self.scl = level
        if level:
            self.ready = clock + self.stretch
            if self.state:
                self.take_bit()
        elif self.held:
            self.held -= 1
        elif self.state:
            self.give_bit()

    def take_bit(self):
        self.bits.append(self.sda & self.out)

    def give_bit(self):
        """The clock has fallen: what the device shows next."""
        n = len(self.bits)
        is_reading = self.state == "read"
        if n == 8 and not is_reading:
            self.out = 0 if self.take_byte() else 1
        elif n == 9 or (n == 0 and is_reading):
            self.end_byte()
        elif is_reading:
            self.out = 1 if n == 8 else self.byte >> (7 - n) & 1

    def take_byte(self):
        byte = int("".join(map(str, self.bits)), 2)
        self.log.append(byte)
        if self.state == "address":
            self.next_state = "read" if byte & 1 else "pointer"
            return byte >> 1 == ADDR and not (byte & 1 and self.refuses_read)
        if self.nack_after is not None:
            self.nack_after -= 1
            if self.nack_after < 0:
                return False
        if self.state == "pointer":
            self.pointer, self.next_state = byte, "write"
        else:
            self.memory[self.pointer] = byte
            self.pointer += 1
        return True

    def end_byte(self):
        is_acknowledged = not self.bits[8]
        self.log.append("+" if is_acknowledged else "-")
        self.bits, self.out = [], 1
        if self.state != "read":
            self.state = self.next_state if is_acknowledged else None
        elif not is_acknowledged:
            self.state = None
        if self.state == "read":
            self.byte = self.memory[self.pointer]
            self.pointer += 1
            self.log.append(self.byte)
            self.out = self.byte >> 7


def configure_software(board, addr=ADDR):
    board.configure(
        ("config_i2c", dict(oid=0)),
        ("i2c_set_sw_bus", dict(oid=0, scl_pin=SCL, sda_pin=SDA,
                                pulse_ticks=PULSE, address=addr)))
    board.run(1000)


def transfer(board, write=b"", read_len=0):
    """(name of the status, data)"""
    n = len(board.messages)
    board.send("i2c_transfer", oid=0, write=write, read_len=read_len)
    board.run_for(.1)
    answer, = board.list_messages("i2c_response", n)
    names = board.dictionary["enumerations"]["i2c_bus_status"]
    status, = [name for name, number in names.items()
               if number == answer["i2c_bus_status"]]
    return status, answer["response"]


def test_software_write(board):
    device = Device(board)
    configure_software(board)
    assert transfer(board, b"\x05\xaa\x00\xff") == ("SUCCESS", b"")
    assert device.memory[4:9] == bytes([104, 0xaa, 0, 0xff, 108])
    assert device.log == ["S", ADDR << 1, "+", 5, "+", 0xaa, "+", 0, "+",
                          0xff, "+", "P"]


def test_software_write_then_read(board):
    device = Device(board)
    configure_software(board)
    assert transfer(board, b"\x07", 3) == ("SUCCESS", bytes([107, 108, 109]))
    assert device.log == ["S", ADDR << 1, "+", 7, "+", "S", ADDR << 1 | 1,
                          "+", 107, "+", 108, "+", 109, "-", "P"]


def test_software_read_only(board):
    device = Device(board)
    device.pointer = 20
    configure_software(board)
    assert transfer(board, b"", 2) == ("SUCCESS", bytes([120, 121]))
    assert device.log[:3] == ["S", ADDR << 1 | 1, "+"]


def test_software_ping(board):
    device = Device(board)
    configure_software(board)
    assert transfer(board) == ("SUCCESS", b"")
    assert device.log == ["S", ADDR << 1, "+", "P"]


def test_software_clock_times(board):
    Device(board)
    configure_software(board)
    transfer(board, b"\x05\xaa")
    edges = board.list_edges(SCL, 1000)
    rises = [clock for clock, level in edges if level]
    falls = [clock for clock, level in edges if not level]
    assert len(rises) == 3 * 9 + 1 and len(falls) == 3 * 9 + 1
    for rise, fall in zip(rises, falls[1:], strict=False):
        assert fall - rise >= PULSE
    for fall, rise in zip(falls, rises, strict=True):
        assert rise - fall >= PULSE
    # Half a bit between every two edges: 100 kHz.
    assert {b - a for a, b in zip(rises[:9], rises[1:9], strict=False)} == \
        {2 * PULSE}


@pytest.mark.parametrize("scenario, status", [
    ("address", "START_NACK"), ("data", "NACK"),
    ("read", "START_READ_NACK")])
def test_software_nack(board, scenario, status):
    device = Device(board)
    device.nack_after = 2 if scenario == "data" else None
    device.refuses_read = scenario == "read"
    configure_software(board, ADDR + (scenario == "address"))
    assert transfer(board, b"\x01\x02\x03\x04", 2) == (status, b"")
    assert device.log[-2:] == ["-", "P"]
    if scenario == "data":
        assert device.memory[1:4] == bytes([2, 102, 103])
    assert board.list_edges(SDA)[-1][1] == board.list_edges(SCL)[-1][1] == 1


def test_a_device_that_holds_the_clock(board):
    device = Device(board)
    device.stretch = 5000
    configure_software(board)
    assert transfer(board, b"\x07", 2) == ("SUCCESS", bytes([107, 108]))
    rises = [clock for clock, level in board.list_edges(SCL, 1000) if level]
    assert min(b - a for a, b in zip(rises[:-1], rises[1:-1],
                                     strict=False)) >= 5000


def test_a_clock_that_never_rises(board):
    device = Device(board)
    configure_software(board)
    device.stretch = 1 << 40
    assert transfer(board, b"\x07", 2) == ("BUS_TIMEOUT", b"")
    answer = board.list_messages("i2c_response")[-1]
    assert answer["#clock"] - 1000 < .005 * board.freq
    device.stretch = device.ready = 0
    device.state = None
    assert transfer(board, b"\x07", 1)[0] == "SUCCESS"


def test_data_that_a_stuck_device_holds_is_clocked_free(board):
    device = Device(board)
    configure_software(board)
    device.held = 5
    assert transfer(board, b"\x07", 1) == ("SUCCESS", bytes([107]))
    device.held = 1 << 30
    assert transfer(board, b"\x07", 1) == ("BUS_TIMEOUT", b"")


def test_hardware_bus(board):
    seen = []
    board.i2c_devices[5, ADDR] = lambda write, n_read: (
        seen.append(write) or bytes(range(n_read)))
    board.configure(("config_i2c", dict(oid=0)), ("i2c_set_bus", dict(
        oid=0, i2c_bus=5, rate=100000, address=ADDR)))
    assert transfer(board, b"\x01\x02", 4) == ("SUCCESS", b"\0\1\2\3")
    assert transfer(board, b"\x03") == ("SUCCESS", b"")
    assert seen == [b"\x01\x02", b"\x03"]
    assert len(transfer(board, b"", 52)[1]) == 52
    board.i2c_devices.clear()
    status, data = transfer(board, b"\x01", 4)
    assert status != "SUCCESS" and data == b""


@pytest.mark.parametrize("name, values, reason", [
    ("config_i2c", dict(oid=0), "Can't assign oid"),
    ("i2c_set_bus", dict(oid=1, i2c_bus=8, rate=1, address=1),
     "Unsupported i2c bus"),
    ("i2c_set_bus", dict(oid=1, i2c_bus=1, rate=1, address=128),
     "Invalid i2c config"),
    ("i2c_set_bus", dict(oid=0, i2c_bus=1, rate=1, address=1),
     "Invalid i2c config"),
    ("i2c_set_sw_bus", dict(oid=0, scl_pin=1, sda_pin=2, pulse_ticks=9,
                            address=1), "Invalid i2c config"),
    ("i2c_set_sw_bus", dict(oid=1, scl_pin=1, sda_pin=300, pulse_ticks=9,
                            address=1), "Not an output pin"),
    ("i2c_transfer", dict(oid=1, write=b"1", read_len=1),
     "Invalid i2c config"),
    ("i2c_transfer", dict(oid=0, write=b"1", read_len=53),
     "Invalid i2c read length"),
    ("i2c_transfer", dict(oid=2, write=b"1", read_len=1),
     "Invalid oid type"),
])
def test_what_cannot_be(board, name, values, reason):
    board.send("allocate_oids", count=3)
    board.send("config_i2c", oid=0)
    board.send("i2c_set_bus", oid=0, i2c_bus=0, rate=1, address=1)
    board.send("config_i2c", oid=1)
    board.send("config_trsync", oid=2)
    board.send(name, **values)
    assert board.find_shutdown() == reason
