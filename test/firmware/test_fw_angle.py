# SPDX-License-Identifier: GPL-3.0-or-later
"""Magnetic angle sensors: frames, times, errors."""

import pytest

START, REST, SHIFT = 40000, 8000, 3
CS = 9
OVERFLOW, LATE, SLOW, CRC, NO_ANGLE = range(1, 6)


def parity(word):
    return bin(word).count("1") & 1


def crc8(data, poly, crc):
    for byte in data:
        for i in reversed(range(8)):
            bit = (crc >> 7) ^ (byte >> i & 1)
            crc = (crc << 1 & 0xff) ^ (poly if bit else 0)
    return crc


class Chip:
    """Angle number n at the nth measurement; `fault` breaks the frames."""

    bits, fault = 14, None

    def __init__(self):
        self.n = 0

    def next_angle(self):
        self.n += 1
        return self.value(self.n - 1) >> (16 - self.bits)

    def value(self, n):
        shift = 16 - self.bits
        return (n * 12345 & 0xffff) >> shift << shift


class A1333(Chip):
    bits = 15
    answers = False

    def transfer(self, data):
        assert data == b"\x32\x00"
        if not self.answers:
            self.answers = True
            return b"\x55\x55"
        word = self.next_angle() | (0x8000 if self.fault == CRC else 0)
        return word.to_bytes(2, "big")


class As5047d(Chip):
    latched = None

    def transfer(self, data):
        if data == b"\x7f\xfe":
            self.latched = self.next_angle()
            return b"\x12\x34"
        assert data == b"\xc0\x00"
        word = self.latched | (0x4000 if self.fault == NO_ANGLE else 0)
        word |= parity(word) << 15
        return (word ^ (self.fault == CRC)).to_bytes(2, "big")


class Mt6816(Chip):
    def transfer(self, data):
        assert data == b"\x83\x00\x00"
        word = self.next_angle() << 2 | (2 if self.fault == NO_ANGLE else 0)
        word |= parity(word)
        return b"\xff" + (word ^ (self.fault == CRC)).to_bytes(2, "big")


class Mt6826s(Chip):
    bits = 15

    def transfer(self, data):
        assert data == b"\xa0\x03\x00\x00\x00\x00"
        word = self.next_angle() << 1
        answer = word.to_bytes(2, "big") + bytes(
            [2 if self.fault == NO_ANGLE else 0])
        crc = crc8(answer, 0x07, 0) ^ (self.fault == CRC)
        return b"\xff\xff" + answer + bytes([crc])


class Tle5012b(Chip):
    bits = 15

    def transfer(self, data):
        assert data[:2] == b"\x84\x23" and len(data) == 10
        n = self.n
        words = [0x8000 | self.next_angle(), 0x8123, 0x8000 | (n & 63) << 9]
        body = b"".join(word.to_bytes(2, "big") for word in words)
        crc = crc8(data[:2] + body, 0x1d, 0xff) ^ 0xff
        return b"\xff\xff" + body + bytes([0xf0, crc ^ (self.fault == CRC)])


CHIPS = {"a1333": A1333, "as5047d": As5047d, "mt6816": Mt6816,
         "mt6826s": Mt6826s, "tle5012b": Tle5012b}


def setup(board, name, chip=None):
    chip = chip or CHIPS[name]()
    board.spi_devices[0] = chip.transfer
    board.configure(
        ("config_spi", dict(oid=0, pin=CS, cs_active_high=0)),
        ("spi_set_bus", dict(oid=0, spi_bus=0, mode=1, rate=4000000)),
        ("config_spi_angle", dict(
            oid=1, spi_oid=0, spi_angle_type=board.dictionary["enumerations"]
            ["spi_angle_type"][name])),
        board.configure_shutdown_at(2, 200))
    return chip


def query(board, rest=REST):
    board.send("query_spi_angle", oid=1, clock=START, rest_ticks=rest,
               time_shift=SHIFT)


def list_samples(board):
    """(first byte, angle or error)"""
    messages = board.list_messages("sensor_bulk_data")
    assert [m["sequence"] for m in messages] == list(range(len(messages)))
    assert {len(m["data"]) for m in messages} <= {51}
    data = b"".join(m["data"] for m in messages)
    return [(data[i], data[i + 1] | data[i + 2] << 8)
            for i in range(0, len(data), 3)]


@pytest.mark.parametrize("name", CHIPS)
def test_angles(board, name):
    chip = setup(board, name)
    query(board)
    board.run(START + 16 * REST - 1)
    assert list_samples(board) == []
    board.run(START + 100 * REST)
    samples = list_samples(board)
    assert len(samples) == 85
    assert [angle for _, angle in samples] == [
        chip.value(n) for n in range(85)]
    if name == "tle5012b":
        assert [code for code, _ in samples] == [n & 63 for n in range(85)]
    else:
        assert {code for code, _ in samples} == {0}


@pytest.mark.parametrize("name, fault, code", [
    ("a1333", CRC, CRC), ("as5047d", CRC, CRC), ("as5047d", NO_ANGLE, CRC),
    ("mt6816", CRC, CRC), ("mt6816", NO_ANGLE, NO_ANGLE),
    ("mt6826s", CRC, CRC), ("mt6826s", NO_ANGLE, NO_ANGLE),
    ("tle5012b", CRC, CRC)])
def test_faults_take_the_place_of_a_sample(board, name, fault, code):
    chip = setup(board, name)
    query(board)
    board.run(START + 4 * REST + 100)
    chip.fault = fault
    board.run(START + 6 * REST + 100)
    chip.fault = None
    board.run(START + 17 * REST)
    samples = list_samples(board)
    assert [n for n, (c, _) in enumerate(samples) if c == 255] == [5, 6]
    assert samples[5] == samples[6] == (255, code)
    assert samples[8][1] == chip.value(8)


def busy(board, ticks):
    """Keep the tasks from running: a display has to be written to."""
    board.send("st7920_send_data", oid=3, data=bytes(max(1, ticks // 1000)))


def test_a_late_task_is_measured_and_missed_ticks_are_errors(board):
    chip = CHIPS["mt6816"]()
    board.spi_devices[0] = chip.transfer
    board.configure(
        ("config_spi", dict(oid=0, pin=CS, cs_active_high=0)),
        ("spi_set_bus", dict(oid=0, spi_bus=0, mode=1, rate=4000000)),
        ("config_spi_angle", dict(oid=1, spi_oid=0, spi_angle_type=3)),
        ("config_st7920", dict(oid=3, cs_pin=101, sclk_pin=102, sid_pin=103,
                               sync_delay_ticks=0, cmd_delay_ticks=1000)))
    query(board)
    board.run(START + 5 * REST - 4000)
    busy(board, 5000)
    board.run(START + 9 * REST - 4000)
    busy(board, 20000)
    board.run(START + 16 * REST)
    samples = list_samples(board)
    late = [code << SHIFT for code, _ in samples]
    assert late[:5] == [0] * 5 and late[6:9] == [0] * 3
    assert 0 < late[5] < 255 << SHIFT
    # The second pause swallowed ticks 9 and 10 or so; numbers still agree.
    missed = [n for n, (c, _) in enumerate(samples) if c == 255]
    assert missed and missed[0] == 9
    assert samples[missed[0]][1] in (OVERFLOW, LATE)
    good = [angle for code, angle in samples if code != 255]
    assert all(angle in [chip.value(n) for n in range(chip.n)]
               for angle in good)
    assert late[12:] == [0] * len(late[12:])


@pytest.mark.parametrize("name", ["mt6816", "tle5012b"])
def test_transfer(board, name):
    setup(board, name)
    board.spi_devices[0] = lambda data: bytes(b ^ 0xff for b in data)
    board.run(1000)
    board.send("spi_angle_transfer", oid=1, data=b"\x84\x42\x00")
    board.run_for(.001)
    answer, = board.list_messages("spi_angle_transfer_response")
    assert answer["response"] == b"\x7b\xbd\xff"
    selects = [c for c, level in board.list_edges(CS, 1000) if not level]
    if name == "tle5012b":
        # The values are taken when an empty frame ends.
        assert len(selects) == 2
        assert answer["clock"] == [c for c, level in board.list_edges(
            CS, 1000) if level][0] == 1020
    else:
        assert selects == [1000] and answer["clock"] == 1000


def test_stop_and_shutdown(board):
    setup(board, "mt6816")
    query(board)
    board.run(START + 20 * REST)
    query(board, rest=0)
    n = len(board.messages)
    board.run(START + 60 * REST)
    assert len(board.messages) == n
    board.send("query_spi_angle", oid=1, clock=START + 70 * REST,
               rest_ticks=REST, time_shift=SHIFT)
    del board.messages[:]
    board.run(START + 90 * REST)
    assert len(list_samples(board)) == 17
    board.send("emergency_stop")
    n = len(board.messages)
    board.run(START + 200 * REST)
    assert len(board.messages) == n


@pytest.mark.parametrize("name, values, reason", [
    ("config_spi_angle", dict(oid=3, spi_oid=0, spi_angle_type=5),
     "Invalid spi_angle chip type"),
    ("config_spi_angle", dict(oid=3, spi_oid=1, spi_angle_type=0),
     "angle sensor requires cs pin"),
    ("config_spi_angle", dict(oid=2, spi_oid=0, spi_angle_type=0),
     "Can't assign oid"),
    ("query_spi_angle", dict(oid=2, clock=0, rest_ticks=1, time_shift=32),
     "Invalid spi_angle time_shift"),
    ("spi_angle_transfer", dict(oid=2, data=bytes(52)),
     "Invalid spi_angle data length"),
    ("spi_angle_transfer", dict(oid=0, data=b""), "Invalid oid type"),
])
def test_what_cannot_be(board, name, values, reason):
    board.send("allocate_oids", count=4)
    board.send("config_spi", oid=0, pin=CS, cs_active_high=0)
    board.send("spi_set_bus", oid=0, spi_bus=0, mode=0, rate=1)
    board.send("config_spi_without_cs", oid=1)
    board.send("config_spi_angle", oid=2, spi_oid=0, spi_angle_type=0)
    board.send(name, **values)
    assert board.find_shutdown() == reason
