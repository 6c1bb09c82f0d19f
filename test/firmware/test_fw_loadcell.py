# SPDX-License-Identifier: GPL-3.0-or-later
"""Load cells and eddy current sensors: readings, errors, triggers."""

import struct

import pytest

REST = 2000
PERIOD = 20000
DOUT, SCLK, DRDY, INTB = 90, 91, 92, 93
ADDR = 0x2A
US = 20


def list_words(board, fmt="<i"):
    messages = board.list_messages("sensor_bulk_data")
    assert [m["sequence"] for m in messages] == list(range(len(messages)))
    assert {len(m["data"]) for m in messages} <= {48}
    return [v for m in messages for v, in struct.iter_unpack(fmt, m["data"])]


def make_values(n):
    return [(i * 1299709) % 0xFFFFFF - 0x7FFFFF for i in range(n)]


class Hx711:
    """A reading every PERIOD; channel and gain as the pulses say."""

    def __init__(self, board, values, pulses=25):
        self.board, self.values, self.pulses = board, values, pulses
        self.taken, self.n_bits, self.gain = 0, 0, 25
        self.ready_at, self.rise, self.off_since = None, None, 0
        self.out, self.restarts, self.deaf = 1, 0, False
        self.gains = []
        board.watchers[SCLK] = self.note_clock
        board.inputs[DOUT] = self.read

    def read(self, clock):
        if self.ready_at is None or clock < self.ready_at:
            return 1
        if self.n_bits:
            return self.out
        return 0

    def note_clock(self, clock, level):
        if level:
            self.rise = clock
            self.shift(clock)
            return
        if self.rise is None or clock - self.rise >= 60 * US:
            self.restarts += self.rise is not None
            self.gain, self.n_bits = 25, 0
            self.ready_at = clock + 5 * PERIOD
        else:
            assert clock - self.rise >= .2 * US

    def shift(self, clock):
        if self.ready_at is None or clock < self.ready_at:
            return
        self.n_bits += 1
        value = self.values[self.taken % len(self.values)]
        if self.n_bits <= 24:
            self.out = value >> (24 - self.n_bits) & 1
        else:
            self.out = 0 if self.deaf else 1
        if self.n_bits == self.pulses:
            self.gains.append(self.gain)
            self.gain = self.n_bits
            self.taken += 1
            self.n_bits = 0
            if not self.deaf:
                self.ready_at += PERIOD


def configure_hx71x(board, values, gain_channel=1):
    chip = Hx711(board, values, 24 + gain_channel)
    board.configure(
        ("config_hx71x", dict(oid=0, gain_channel=gain_channel,
                              dout_pin=DOUT, sclk_pin=SCLK)),
        ("config_trsync", dict(oid=1)),
        ("config_sos_filter", dict(oid=2, max_sections=0)),
        ("config_trigger_analog", dict(oid=3, sos_filter_oid=2)),
        ("hx71x_attach_trigger_analog", dict(oid=0, trigger_analog_oid=3)))
    board.run(100 * US)  # powered down
    return chip


def run_steps(board, clock, step=REST):
    while board.clock < clock:
        board.run(board.clock + step)


def home(board, value):
    board.send("trigger_analog_set_trigger", oid=3, trigger_analog_type=1,
               trigger_value=value)
    board.send("trsync_start", oid=1, report_clock=0, report_ticks=0,
               expire_reason=9)
    board.send("trigger_analog_home", oid=3, trsync_oid=1, trigger_reason=1,
               error_reason=20, clock=board.clock, monitor_ticks=0,
               monitor_max=0)


def find_reason(board):
    found = [m["trigger_reason"] for m in board.list_messages("trsync_state")
             if not m["can_trigger"]]
    return found[0] if found else None


def sensor_error(board, n):
    return 20 + n + board.dictionary["enumerations"]["trigger_analog_error:"][
        "SENSOR_SPECIFIC"]


@pytest.mark.parametrize("gain_channel", [1, 2, 3, 4])
def test_hx71x_readings(board, gain_channel):
    values = make_values(100)
    chip = configure_hx71x(board, values, gain_channel)
    board.send("query_hx71x", oid=0, rest_ticks=REST)
    board.run(60 * PERIOD)
    got = list_words(board)
    # The first reading still has the gain of a chip that has just started.
    assert got == values[1:len(got) + 1] and len(got) == 48
    assert chip.gains == [25] + [24 + gain_channel] * (chip.taken - 1)
    status = board.query("query_hx71x_status", "sensor_bulk_status", oid=0)
    assert status["next_sequence"] == 4
    assert status["buffered"] == 4 * (chip.taken - 1 - 48)


def test_hx71x_pulses_are_short(board):
    configure_hx71x(board, make_values(9))
    board.send("query_hx71x", oid=0, rest_ticks=REST)
    board.run(8 * PERIOD)
    edges = board.list_edges(SCLK, 1)[1:]
    assert len(edges) == 2 * 25 * 3
    widths = {b - a for (a, level), (b, _) in zip(edges, edges[1:],
                                                  strict=False) if level}
    assert max(widths) < 1 * US


def test_hx71x_trigger(board):
    configure_hx71x(board, [10, 20, 30, 99, 101, 102])
    home(board, 100)
    board.send("query_hx71x", oid=0, rest_ticks=REST)
    board.run(8 * PERIOD + 3 * REST)
    assert find_reason(board) is None
    board.run(9 * PERIOD + 3 * REST)
    assert find_reason(board) == 1


def test_hx71x_out_of_step(board):
    chip = configure_hx71x(board, [5] * 200)
    board.send("query_hx71x", oid=0, rest_ticks=REST)
    board.run(10 * PERIOD)
    home(board, 100)
    chip.deaf = True
    board.run(12 * PERIOD)
    assert find_reason(board) == sensor_error(board, 0)
    assert chip.restarts == 2  # the first was the start
    chip.deaf = False
    board.run(80 * PERIOD)
    got = list_words(board)
    assert got.count(-0x80000000) == 1 and got.count(5) == len(got) - 1
    assert board.find_shutdown() is None


def test_hx71x_powers_down_at_rest(board):
    configure_hx71x(board, [5] * 200)
    board.send("query_hx71x", oid=0, rest_ticks=REST)
    board.run(10 * PERIOD)
    board.send("query_hx71x", oid=0, rest_ticks=0)
    assert board.list_edges(SCLK)[-1][1] == 1
    board.run(11 * PERIOD)
    board.send("query_hx71x", oid=0, rest_ticks=REST)
    assert board.list_edges(SCLK)[-1][1] == 0
    board.send("emergency_stop")
    assert board.list_edges(SCLK)[-1][1] == 1


class Spi:
    """Readings over SPI; DRDY is low from a reading until it is fetched."""

    def __init__(self, board, values):
        self.board, self.values, self.taken = board, values, 0
        self.next_at = PERIOD
        board.inputs[DRDY] = lambda clock: clock < self.next_at
        board.spi_devices[0] = self.transfer

    def take(self):
        self.taken += 1
        self.next_at += PERIOD
        return self.values[self.taken - 1]


class Ads1220(Spi):
    def transfer(self, data):
        assert data == bytes(3)
        return (self.take() & 0xFFFFFF).to_bytes(3, "big")


class Ads131(Spi):
    channel, n_channels, status, broken = 0, 4, 0x0500 & ~0x0400, False

    def transfer(self, data):
        assert data == bytes(3 * (self.n_channels + 2))
        words = [self.status << 8] + [0x123456] * self.n_channels
        words[1 + self.channel] = self.take() & 0xFFFFFF
        frame = b"".join(word.to_bytes(3, "big") for word in words)
        crc = 0xFFFF
        for byte in frame:
            for i in reversed(range(8)):
                bit = (crc >> 15) ^ (byte >> i & 1)
                crc = crc << 1 & 0xFFFF ^ (0x1021 if bit else 0)
        return frame + (crc ^ self.broken).to_bytes(2, "big") + b"\0"


def configure_spi(board, name, **values):
    board.configure(
        ("config_spi", dict(oid=4, pin=9, cs_active_high=0)),
        ("spi_set_bus", dict(oid=4, spi_bus=0, mode=1, rate=512000)),
        ("config_" + name, dict(oid=0, spi_oid=4, data_ready_pin=DRDY,
                                **values)),
        ("config_trsync", dict(oid=1)),
        ("config_sos_filter", dict(oid=2, max_sections=0)),
        ("config_trigger_analog", dict(oid=3, sos_filter_oid=2)),
        (name + "_attach_trigger_analog", dict(oid=0, trigger_analog_oid=3)))
    board.send("query_" + name, oid=0, rest_ticks=REST)


def test_ads1220(board):
    values = make_values(100)
    Ads1220(board, values)
    configure_spi(board, "ads1220")
    board.run(60 * PERIOD)
    got = list_words(board)
    assert len(got) >= 48 and got == values[:len(got)]
    status = board.query("query_ads1220_status", "sensor_bulk_status", oid=0)
    assert status["next_sequence"] * 48 + status["buffered"] == 4 * 60


def test_ads1220_trigger(board):
    Ads1220(board, [5, 90, 101, 5])
    configure_spi(board, "ads1220")
    home(board, 100)
    board.run(2 * PERIOD + REST)
    assert find_reason(board) is None
    board.run(3 * PERIOD + REST)
    assert find_reason(board) == 1


@pytest.mark.parametrize("channel, n_channels", [
    (0, 2), (1, 2), (2, 3), (3, 4), (5, 6), (7, 8)])
def test_ads131m0x(board, channel, n_channels):
    values = make_values(100)
    chip = Ads131(board, values)
    chip.channel, chip.n_channels = channel, n_channels
    configure_spi(board, "ads131m0x", channel=channel,
                  num_channels=n_channels)
    board.run(60 * PERIOD)
    got = list_words(board)
    assert len(got) >= 48 and got == values[:len(got)]


@pytest.mark.parametrize("status, broken, name", [
    (0x0500, 0, "SENSOR_ERROR_RESET"), (0x0100, 1, "SENSOR_ERROR_CRC"),
    (0x0100, 0x8000, "SENSOR_ERROR_CRC")])
def test_ads131m0x_errors(board, status, broken, name):
    chip = Ads131(board, [7] * 99)
    configure_spi(board, "ads131m0x", channel=0, num_channels=4)
    home(board, 100)
    board.run(5 * PERIOD + REST)
    chip.status, chip.broken = status, broken
    board.run(6 * PERIOD + REST)
    number = board.dictionary["enumerations"]["ads131m0x_error:"][name]
    assert find_reason(board) == sensor_error(board, number)
    chip.status, chip.broken = 0x0100, 0
    board.run(13 * PERIOD)
    assert list_words(board) == [7] * 5 + [number - 0x80000000] + [7] * 6


class Ldc1612:
    def __init__(self, board, values):
        self.board, self.values, self.taken = board, values, 0
        self.fails = set()
        self.status_reads = 0
        board.i2c_devices[0, ADDR] = self.transfer
        board.inputs[INTB] = lambda clock: not self.has_result(clock)

    def has_result(self, clock):
        return clock >= (self.taken + 1) * PERIOD

    def transfer(self, write, n):
        reg, = write
        if reg in self.fails:
            return None
        assert n == 2
        if reg == 0x18:
            self.status_reads += 1
            return bytes([0, 0x48 if self.has_result(self.board.clock)
                          else 0x40])
        word = self.values[self.taken].to_bytes(4, "big")
        if reg == 0x00:
            return word[:2]
        assert reg == 0x01
        self.taken += 1
        return word[2:]


def configure_ldc(board, has_intb=False):
    config = (("config_ldc1612_with_intb",
               dict(oid=0, i2c_oid=4, intb_pin=INTB)) if has_intb
              else ("config_ldc1612", dict(oid=0, i2c_oid=4)))
    board.configure(
        ("config_i2c", dict(oid=4)),
        ("i2c_set_bus", dict(oid=4, i2c_bus=0, rate=400000, address=ADDR)),
        config, ("config_trsync", dict(oid=1)),
        ("config_sos_filter", dict(oid=2, max_sections=0)),
        ("config_trigger_analog", dict(oid=3, sos_filter_oid=2)),
        ("ldc1612_attach_trigger_analog", dict(oid=0, trigger_analog_oid=3)))
    board.send("query_ldc1612", oid=0, rest_ticks=REST)


@pytest.mark.parametrize("has_intb", [False, True])
def test_ldc1612(board, has_intb):
    values = [0x0123456 + 0x10001 * i for i in range(100)]
    chip = Ldc1612(board, values)
    configure_ldc(board, has_intb)
    run_steps(board, 60 * PERIOD)
    got = list_words(board, ">I")
    assert len(got) >= 48 and got == values[:len(got)]
    # The pin spares the bus.
    assert (chip.status_reads <= chip.taken) == has_intb
    status = board.query("query_status_ldc1612", "sensor_bulk_status", oid=0)
    assert status["next_sequence"] * 48 + status["buffered"] == 4 * 60


def test_ldc1612_trigger(board):
    Ldc1612(board, [500, 600, 700, 100])
    configure_ldc(board)
    home(board, 650)
    run_steps(board, 2 * PERIOD + REST)
    assert find_reason(board) is None
    run_steps(board, 3 * PERIOD + REST)
    assert find_reason(board) == 1


@pytest.mark.parametrize("name", [
    "SENSOR_REPORTS_ERROR", "I2C_STATUS_ERROR", "I2C_DATA_ERROR",
    "INVALID_READ_DATA"])
def test_ldc1612_errors(board, name):
    values = [500] * 30
    chip = Ldc1612(board, values)
    configure_ldc(board)
    home(board, 650)
    run_steps(board, 2 * PERIOD + REST)
    values[2] = {"SENSOR_REPORTS_ERROR": 0x40000000 + 500,
                 "INVALID_READ_DATA": 0}.get(name, 500)
    chip.fails = {"I2C_STATUS_ERROR": {0x18}, "I2C_DATA_ERROR": {0x01}}.get(
        name, set())
    run_steps(board, 3 * PERIOD + REST)
    number = board.dictionary["enumerations"]["ldc1612_error:"][name]
    assert find_reason(board) == sensor_error(board, number)
    chip.fails = set()
    run_steps(board, 20 * PERIOD)
    got = list_words(board, ">I")
    if name == "SENSOR_REPORTS_ERROR":
        assert got[2] == 0x40000000 + 500
    if name == "I2C_DATA_ERROR":
        assert 0xffffffff in got
    assert board.find_shutdown() is None


@pytest.mark.parametrize("name, values, reason", [
    ("config_hx71x", dict(oid=2, gain_channel=0, dout_pin=1, sclk_pin=2),
     "HX71x gain/channel out of range 1-4"),
    ("config_hx71x", dict(oid=2, gain_channel=5, dout_pin=1, sclk_pin=2),
     "HX71x gain/channel out of range 1-4"),
    ("config_hx71x", dict(oid=0, gain_channel=1, dout_pin=1, sclk_pin=2),
     "Can't assign oid"),
    *[("config_ads131m0x", dict(oid=2, spi_oid=1, channel=channel,
                                num_channels=number, data_ready_pin=1),
       "Invalid ads131m0x channels configuration")
      for channel, number in [(0, 0), (0, 1), (0, 5), (0, 7), (0, 9), (2, 2)]],
    ("config_ads1220", dict(oid=2, spi_oid=0, data_ready_pin=1),
     "Invalid oid type"),
    ("config_ldc1612", dict(oid=2, i2c_oid=1), "Invalid oid type"),
    ("query_hx71x", dict(oid=1, rest_ticks=9), "Invalid oid type"),
    ("hx71x_attach_trigger_analog", dict(oid=0, trigger_analog_oid=1),
     "Invalid oid type"),
])
def test_what_cannot_be(board, name, values, reason):
    board.send("allocate_oids", count=3)
    board.send("config_hx71x", oid=0, gain_channel=1, dout_pin=1, sclk_pin=2)
    board.send("config_spi_without_cs", oid=1)
    board.send(name, **values)
    assert board.find_shutdown() == reason
