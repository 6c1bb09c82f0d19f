# SPDX-License-Identifier: GPL-3.0-or-later
"""Accelerometers: every sample of their FIFOs arrives, once, in order."""

import struct

import pytest

REST = 20000  # ticks: 1 ms
ADDR = 0x19


def make_samples(n, limit=30000):
    return [((i * 7919) % limit - limit // 2, (i * 104729) % limit - limit // 2,
             -((i * 1299709) % limit) + limit // 2) for i in range(n)]


class Fifo:
    """Samples that appear one every `period` ticks of the board."""

    def __init__(self, board, samples, period, size=32):
        self.board, self.samples, self.period = board, samples, period
        self.size, self.n_read, self.lost = size, 0, 0

    def count(self):
        n_made = min(len(self.samples), self.now() // self.period)
        if n_made - self.n_read > self.size:
            self.lost += n_made - self.n_read - self.size
            self.n_read = n_made - self.size
        return n_made - self.n_read

    def now(self):
        return self.board.clock

    def take(self):
        assert self.count(), "read from an empty FIFO"
        self.n_read += 1
        return self.samples[self.n_read - 1]


class Adxl345(Fifo):
    broken = False

    def __call__(self, data):
        if data[0] == 0xb9:
            return bytes([0, self.count()])
        assert data[0] == 0xf2 and len(data) == 9
        axes = struct.pack("<3h", *self.take())
        answer = bytes([0]) + axes + bytes([0x80, self.count()])
        return bytes(9) if self.broken else answer


class Lis(Fifo):
    """LIS2DW on either bus; flags are what a read must set."""

    read_flags = 0
    count_mask = 0x3f

    def read(self, reg, n):
        reg -= self.read_flags
        if reg == 0x2f:
            count = self.count()
            full = 0x40 if count == self.size else 0
            return bytes([count & self.count_mask | full])
        assert reg == 0x28 and n == 6
        return struct.pack("<3h", *self.take())


class Bmi160(Fifo):
    read_flags = 0

    def read(self, reg, n):
        reg -= self.read_flags
        if reg == 0x22:
            return struct.pack("<H", 6 * self.count() | 0xf000)
        assert reg == 0x24 and n % 6 == 0
        return b"".join(struct.pack("<3h", *self.take())
                        for _ in range(n // 6))


class Mpu(Fifo):
    registers = dict(count=0x72, data=0x74, status=0x3a, overflow=0x10)

    def read(self, reg, n):
        if reg == self.registers["count"]:
            return struct.pack(">H", 6 * self.count())
        if reg == self.registers["status"]:
            return bytes([self.registers["overflow"] if self.lost else 0x20])
        assert reg == self.registers["data"] and n % 6 == 0
        return b"".join(struct.pack(">3h", *self.take())
                        for _ in range(n // 6))


class Icm(Mpu):
    registers = dict(count=0x70, data=0x72, status=0x1b, overflow=0x01)


def wire(board, chip, bus):
    """Put the chip on a bus; the config commands for it."""
    if bus == "spi":
        board.spi_devices[0] = chip if callable(chip) else (
            lambda data: bytes(1) + chip.read(data[0], len(data) - 1))
        return [("config_spi", dict(oid=0, pin=9, cs_active_high=0)),
                ("spi_set_bus", dict(oid=0, spi_bus=0, mode=3, rate=5000000))]
    board.i2c_devices[0, ADDR] = lambda write, n: chip.read(write[0], n)
    return [("config_i2c", dict(oid=0)),
            ("i2c_set_bus", dict(oid=0, i2c_bus=0, rate=400000,
                                 address=ADDR))]


def setup(board, chip, name, bus, **values):
    board.configure(*wire(board, chip, bus),
                    ("config_" + name, dict(oid=1, **values)))


def run_measurement(board, name, clock):
    board.send("query_" + name, oid=1, rest_ticks=REST)
    # In small steps, so that the models know what time it is.
    while board.clock < clock:
        board.run(board.clock + REST // 4)


def list_data(board, size=6):
    """Samples as they came, with the sequence numbers checked."""
    messages = board.list_messages("sensor_bulk_data")
    assert [m["sequence"] for m in messages] == list(range(len(messages)))
    assert {len(m["data"]) for m in messages} == {51 // size * size}
    data = b"".join(m["data"] for m in messages)
    return [data[i:i + size] for i in range(0, len(data), size)]


def unpack_adxl(sample):
    xlow, ylow, zlow, xzhigh, yzhigh = sample
    z = zlow | (xzhigh >> 5 | (yzhigh >> 5 & 3) << 3) << 8
    axes = [xlow | (xzhigh & 0x1f) << 8, ylow | (yzhigh & 0x1f) << 8, z]
    return tuple(axis - 0x2000 if axis & 0x1000 else axis for axis in axes)


def test_adxl345_samples(board):
    chip = Adxl345(board, make_samples(300, 8000), 7000)
    setup(board, chip, "adxl345", "spi", spi_oid=0)
    run_measurement(board, "adxl345", 250 * 7000)
    got = [unpack_adxl(sample) for sample in list_data(board, 5)]
    assert len(got) >= 240 and len(got) % 10 == 0
    assert got == chip.samples[:len(got)]
    assert all(not sample[4] & 0x80 for sample in list_data(board, 5))


def test_adxl345_marks_a_bad_transfer(board):
    chip = Adxl345(board, make_samples(300, 8000), 7000)
    setup(board, chip, "adxl345", "spi", spi_oid=0)
    chip.broken = True
    run_measurement(board, "adxl345", 100 * 7000)
    assert set(list_data(board, 5)) == {b"\xff" * 5}


CHIPS = [
    (Lis, "lis2dw", "spi", dict(bus_oid=0, bus_oid_type=0, lis_chip_type=0),
     0x80, "<"),
    (Lis, "lis2dw", "i2c", dict(bus_oid=0, bus_oid_type=1, lis_chip_type=0),
     0, "<"),
    (Lis, "lis2dw", "spi", dict(bus_oid=0, bus_oid_type=0, lis_chip_type=1),
     0xc0, "<"),
    (Lis, "lis2dw", "i2c", dict(bus_oid=0, bus_oid_type=1, lis_chip_type=1),
     0x80, "<"),
    (Mpu, "mpu9250", "i2c", dict(i2c_oid=0), 0, ">"),
    (Icm, "icm20948", "i2c", dict(i2c_oid=0), 0, ">"),
    (Bmi160, "bmi160", "spi", dict(bus_oid=0, bus_oid_type=0), 0x80, "<"),
    (Bmi160, "bmi160", "i2c", dict(bus_oid=0, bus_oid_type=1), 0, "<"),
]


@pytest.mark.parametrize("kind, name, bus, values, flags, order", CHIPS)
def test_fifo_samples(board, kind, name, bus, values, flags, order):
    chip = kind(board, make_samples(300), 3000)
    chip.read_flags = flags
    setup(board, chip, name, bus, **values)
    run_measurement(board, name, 280 * 3000)
    got = [struct.unpack(order + "3h", data) for data in list_data(board)]
    assert len(got) >= 260 and len(got) % 8 == 0
    assert got == chip.samples[:len(got)]
    status = board.query("query_%s_status" % (name,), "sensor_bulk_status",
                         oid=1)
    assert status["possible_overflows"] == 0
    assert status["next_sequence"] * 8 == len(got)
    n_made = board.clock // 3000
    assert status["next_sequence"] * 48 + status["buffered"] == 6 * n_made


@pytest.mark.parametrize("kind, name, bus, values, flags, order", CHIPS)
def test_fifo_overflow(board, kind, name, bus, values, flags, order):
    size = 170 if kind is Bmi160 else 31 if flags in (0xc0,) else 32
    chip = kind(board, make_samples(3000), 300, size)
    chip.read_flags = flags
    chip.count_mask = 0x3f if kind is Lis and size == 32 else 0x1f
    setup(board, chip, name, bus, **values)
    # Nobody looks for far too long.
    board.send("query_" + name, oid=1, rest_ticks=REST)
    board.clock = 200 * 300
    board.run(board.clock)
    board.clock = 2000 * 300
    status = board.query("query_%s_status" % (name,), "sensor_bulk_status",
                         oid=1)
    assert status["possible_overflows"] > 0


def test_status_of_an_adxl345(board):
    chip = Adxl345(board, make_samples(300, 8000), 7000)
    setup(board, chip, "adxl345", "spi", spi_oid=0)
    run_measurement(board, "adxl345", 35 * 7000)
    status = board.query("query_adxl345_status", "sensor_bulk_status", oid=1)
    assert status["next_sequence"] * 50 + status["buffered"] == 5 * 35
    assert status["clock"] == board.clock and status["query_ticks"] == 0
    assert status["possible_overflows"] == 0
    chip.n_read = 0
    board.run(board.clock + REST)
    status = board.query("query_adxl345_status", "sensor_bulk_status", oid=1)
    assert status["possible_overflows"] > 0


def test_stop_and_start_anew(board):
    chip = Lis(board, make_samples(3000), 3000)
    setup(board, chip, "lis2dw", "i2c", **CHIPS[1][3])
    run_measurement(board, "lis2dw", 100 * 3000)
    board.send("query_lis2dw", oid=1, rest_ticks=0)
    n = len(board.messages)
    board.run_for(.1)
    assert len(board.messages) == n
    chip.n_read = board.clock // 3000
    del board.messages[:]
    first = chip.n_read
    run_measurement(board, "lis2dw", board.clock + 100 * 3000)
    got = [struct.unpack("<3h", data) for data in list_data(board)]
    assert got == chip.samples[first:first + len(got)] and len(got) > 80


def test_two_sensors_at_once(board):
    chips = [Lis(board, make_samples(900), 3000),
             Mpu(board, make_samples(900)[::-1], 4000)]
    for addr, chip in enumerate(chips):
        board.i2c_devices[0, addr] = (
            lambda write, n, chip=chip: chip.read(write[0], n))
    board.configure(
        *[("config_i2c", dict(oid=oid)) for oid in (0, 1)],
        *[("i2c_set_bus", dict(oid=oid, i2c_bus=0, rate=1, address=oid))
          for oid in (0, 1)],
        ("config_lis2dw", dict(oid=2, bus_oid=0, bus_oid_type=1,
                               lis_chip_type=0)),
        ("config_mpu9250", dict(oid=3, i2c_oid=1)))
    board.send("query_lis2dw", oid=2, rest_ticks=REST)
    run = dict(oid=3, rest_ticks=REST + 1000)
    board.send("query_mpu9250", **run)
    for _ in range(100):
        board.run(board.clock + REST // 4)
    board.send("query_lis2dw", oid=2, rest_ticks=0)
    for _ in range(100):
        board.run(board.clock + REST // 4)
    for oid, chip, order in [(2, chips[0], "<"), (3, chips[1], ">")]:
        data = b"".join(m["data"] for m in board.list_messages(
            "sensor_bulk_data") if m["oid"] == oid)
        got = list(struct.iter_unpack(order + "3h", data))
        assert len(got) > 100 and got == chip.samples[:len(got)]


def test_shutdown_and_a_new_start(board):
    chip = Lis(board, make_samples(3000), 3000)
    setup(board, chip, "lis2dw", "i2c", **CHIPS[1][3])
    run_measurement(board, "lis2dw", 50 * 3000)
    board.send("emergency_stop")
    n = len(board.messages)
    board.run_for(.1)
    assert len(board.messages) == n
    board.send("clear_shutdown")
    del board.messages[:]
    chip.n_read = board.clock // 3000
    run_measurement(board, "lis2dw", board.clock + 100 * 3000)
    assert len(list_data(board)) >= 80


def test_a_sensor_that_does_not_answer(board):
    setup(board, Mpu(board, [], 1), "mpu9250", "i2c", i2c_oid=0)
    board.i2c_devices.clear()
    run_measurement(board, "mpu9250", 10 * REST)
    status = board.query("query_mpu9250_status", "sensor_bulk_status", oid=1)
    assert status["possible_overflows"] >= 9
    assert board.find_shutdown() is None


@pytest.mark.parametrize("name, values, reason", [
    ("config_lis2dw", dict(oid=3, bus_oid=0, bus_oid_type=1, lis_chip_type=2),
     "model type invalid"),
    ("config_lis2dw", dict(oid=3, bus_oid=0, bus_oid_type=2, lis_chip_type=1),
     "bus_type invalid"),
    ("config_lis2dw", dict(oid=3, bus_oid=0, bus_oid_type=0, lis_chip_type=1),
     "Invalid oid type"),
    ("config_adxl345", dict(oid=3, spi_oid=0), "Invalid oid type"),
    ("config_bmi160", dict(oid=0, bus_oid=0, bus_oid_type=1),
     "Can't assign oid"),
    ("query_icm20948", dict(oid=1, rest_ticks=1), "Invalid oid type"),
    ("query_mpu9250_status", dict(oid=0), "Invalid oid type"),
    ("query_adxl345_status", dict(oid=1), "Invalid oid type"),
])
def test_what_cannot_be(board, name, values, reason):
    board.send("allocate_oids", count=4)
    board.send("config_i2c", oid=0)
    board.send("config_mpu9250", oid=1, i2c_oid=0)
    board.send(name, **values)
    assert board.find_shutdown() == reason
