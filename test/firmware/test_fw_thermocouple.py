# SPDX-License-Identifier: GPL-3.0-or-later
"""Thermocouple converters: registers, readings, faults."""

import pytest

START, REST = 20000, 50000


class Registers:
    """A chip that answers with registers from an address on."""

    def __init__(self, values):
        self.values, self.reads = values, []

    def __call__(self, data):
        reg, n = data[0], len(data) - 1
        self.reads.append((reg, n))
        return b"\xff" + bytes(self.values[reg + i] for i in range(n))


def start(board, chip, device, low=0, high=0xffffffff, bad=3):
    board.spi_devices[0] = device
    board.configure(
        ("config_spi", dict(oid=0, pin=9, cs_active_high=0)),
        ("spi_set_bus", dict(oid=0, spi_bus=0, mode=0, rate=4000000)),
        ("config_thermocouple", dict(
            oid=1, spi_oid=0,
            thermocouple_type=board.dictionary["enumerations"]
            ["thermocouple_type"][chip])))
    board.send("query_thermocouple", oid=1, clock=START, rest_ticks=REST,
               min_value=low, max_value=high, max_invalid_count=bad)


def list_results(board):
    return [(m["next_clock"], m["value"], m["fault"])
            for m in board.list_messages("thermocouple_result")]


@pytest.mark.parametrize("chip, answer, value, fault", [
    ("MAX31855", b"\x64\x00\x19\x00", 0x64001900, 0),
    ("MAX31855", b"\x64\x01\x19\x05", 0x64011905, 5),
    ("MAX6675", b"\x0c\xb8", 0x0cb8, 0),
    ("MAX6675", b"\x0c\xbc", 0x0cbc, 4),
    ("MAX6675", b"\x0c\xbb", 0x0cbb, 2),
])
def test_chips_without_registers(board, chip, answer, value, fault):
    sizes = []
    start(board, chip, lambda data: sizes.append(len(data)) or answer)
    board.run(START)
    assert list_results(board) == [(START + REST, value, fault)]
    assert sizes == [len(answer)]


@pytest.mark.parametrize("fault", [0, 1, 0x80])
def test_max31856(board, fault):
    chip = Registers({0xc: 0x12, 0xd: 0x34, 0xe: 0x56, 0xf: fault})
    start(board, "MAX31856", chip)
    board.run(START)
    assert list_results(board) == [(START + REST, 0x123456, fault)]
    assert chip.reads == [(0xc, 3), (0xf, 1)]


@pytest.mark.parametrize("low, status, fault", [
    (0x78, 0, 0), (0x79, 0x40, 0x41), (0x79, 0, 1), (0x78, 0x07, 0x04)])
def test_max31865(board, low, status, fault):
    chip = Registers({1: 0x43, 2: low, 7: status})
    start(board, "MAX31865", chip)
    board.run(START)
    assert list_results(board) == [(START + REST, 0x4300 | low, fault)]
    assert chip.reads == [(1, 2), (7, 1)]


def test_readings_come_regularly(board):
    start(board, "MAX6675", lambda data: b"\x10\x00")
    board.run(START + 9 * REST)
    assert [m["#clock"] for m in board.list_messages("thermocouple_result")] \
        == [START + i * REST for i in range(10)]
    board.send("query_thermocouple", oid=1, clock=0, rest_ticks=0,
               min_value=0, max_value=0, max_invalid_count=0)
    board.run(START + 20 * REST)
    assert len(list_results(board)) == 10


def test_out_of_range_in_a_row(board):
    values = iter([5, 100, 101, 50, 9, 10, 101, 102, 9] + [50] * 9)
    start(board, "MAX6675", lambda data: (8 * next(values)).to_bytes(2, "big"),
          low=80, high=800)
    board.run(START + 20 * REST)
    # 5; 101; 9 are each alone; 101, 102, 9 are three in a row.
    assert board.find_shutdown() == "Thermocouple reader fault"
    assert len(list_results(board)) == 9


def test_faults_in_a_row(board):
    start(board, "MAX31855", lambda data: b"\x20\x01\x00\x01", bad=2)
    board.run(START)
    assert board.find_shutdown() is None
    board.run(START + REST)
    assert board.find_shutdown() == "Thermocouple reader fault"


def test_shutdown_stops(board):
    start(board, "MAX6675", lambda data: b"\x10\x00")
    board.run(START + REST)
    board.send("emergency_stop")
    n = len(list_results(board))
    board.run(START + 9 * REST)
    assert len(list_results(board)) == n


@pytest.mark.parametrize("values, reason", [
    (dict(oid=2, spi_oid=0, thermocouple_type=4),
     "Invalid thermocouple chip type"),
    (dict(oid=2, spi_oid=1, thermocouple_type=0), "Invalid oid type"),
    (dict(oid=0, spi_oid=0, thermocouple_type=0), "Can't assign oid"),
])
def test_what_cannot_be(board, values, reason):
    board.send("allocate_oids", count=3)
    board.send("config_spi_without_cs", oid=0)
    board.send("config_trsync", oid=1)
    board.send("config_thermocouple", **values)
    assert board.find_shutdown() == reason
