# SPDX-License-Identifier: GPL-3.0-or-later
"""SPI, I2C and pulses of the AVR firmware on an emulated chip."""

import pytest
import simavr_chip
from simavr_board import AvrBoard, find_pin

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]
MS = 16000


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return simavr_chip.build_adapter(tmp_path_factory.mktemp("simavr"))


@pytest.fixture(scope="module", params=["atmega2560", "atmega644p"])
def chip(request, tmp_path_factory):
    """(name of the chip, its firmware)"""
    out = tmp_path_factory.mktemp("avr")
    return request.param, simavr_chip.build_firmware(out, request.param)


@pytest.fixture
def board(chip, adapter, monkeypatch):
    simavr_chip.choose_chip(monkeypatch, chip[1], chip[0])
    return AvrBoard(adapter)


def test_spi(board):
    sent = []
    board.spi_devices[0] = lambda data: sent.append(data) or bytes(
        byte ^ 0xff for byte in data)
    board.configure(
        ("config_spi", dict(oid=0, pin=find_pin(board, "PC7"),
                            cs_active_high=0)),
        ("spi_set_bus", dict(oid=0, spi_bus=board.dictionary["enumerations"]
                             ["spi_bus"]["spi"], mode=3, rate=4000000)))
    answer = board.query("spi_transfer", "spi_transfer_response", oid=0,
                         data=b"\x00\xa5\x42")
    assert answer["response"] == b"\xff\x5a\xbd"
    assert b"".join(sent) == b"\x00\xa5\x42"
    select = board.list_edges(find_pin(board, "PC7"))
    assert [level for _, level in select][-2:] == [0, 1]


def test_i2c_without_devices_ends(board):
    """Nobody there, on the emulated bus as on a real one."""
    board.configure(("config_i2c", dict(oid=0)), ("i2c_set_bus", dict(
        oid=0, i2c_bus=board.dictionary["enumerations"]["i2c_bus"]["twi"],
        rate=100000, address=0x4C)))
    answer = board.query("i2c_transfer", "i2c_response", oid=0,
                         write=b"\x05", read_len=3)
    names = board.dictionary["enumerations"]["i2c_bus_status"]
    assert answer["i2c_bus_status"] == names["START_NACK"]
    assert answer["response"] == b""


@pytest.mark.parametrize("reading", [0, -1, 0x7FFFFF, -0x7FFFFF, 12345])
def test_software_pins_and_hx711(board, reading):
    """A load cell clocked by hand: its pulses stay far below 60 us."""
    dout, sclk = find_pin(board, "PC4"), find_pin(board, "PC5")
    state = {"n": 0}

    def shift(clock, level):
        if level:
            state["n"] = state["n"] % 25 + 1

    board.watchers[sclk] = shift
    board.inputs[dout] = lambda clock: (
        0 if not state["n"] else 1 if state["n"] == 25
        else (reading & 0xFFFFFF) >> (24 - state["n"]) & 1)
    board.configure(("config_hx71x", dict(oid=0, gain_channel=1,
                                          dout_pin=dout, sclk_pin=sclk)))
    state["n"] = 0
    board.send("query_hx71x", oid=0, rest_ticks=8000)
    for _ in range(40):
        board.run(board.clock + MS)
        if state["n"] == 25:
            state["n"] = 0
    data = b"".join(m["data"] for m in board.list_messages(
        "sensor_bulk_data"))
    values = {int.from_bytes(data[i:i + 4], "little", signed=True)
              for i in range(0, len(data), 4)}
    assert values == {reading}
    edges = board.list_edges(sclk)[2:]
    highs = [b - a for (a, level), (b, _) in zip(edges, edges[1:],
                                                 strict=False) if level]
    assert max(highs) < 10 * board.freq / 1e6


def test_neopixel_pulses(board):
    """What WS2812 leds want, in cycles of the real instructions."""
    pin = find_pin(board, "PC6")
    board.configure(("config_neopixel", dict(
        oid=0, pin=pin, data_size=6, bit_max_ticks=64, reset_min_ticks=800)))
    board.send("neopixel_update", oid=0, pos=0, data=b"\x00\xff\xa5\x5a\x01\x80")
    n = len(board.edges)
    answer = board.query("neopixel_send", "neopixel_result", oid=0)
    assert answer["success"] == 1
    edges = [(c, lv) for c, p, lv in board.edges[n:] if p == pin]
    assert len(edges) == 2 * 48
    clocks = [clock for clock, _ in edges]
    highs = [b - a for a, b in zip(clocks[::2], clocks[1::2], strict=True)]
    bits = "".join("1" if high > 9 else "0" for high in highs)
    assert int(bits, 2).to_bytes(6, "big") == b"\x00\xff\xa5\x5a\x01\x80"
    ns = 1e9 / board.freq
    assert all(200 <= high * ns <= 500 or 550 <= high * ns <= 1000
               for high in highs)
    periods = [b - a for a, b in zip(clocks[::2], clocks[2::2], strict=False)]
    assert min(periods) * ns >= 1200 and max(periods) * ns <= 5000
