# SPDX-License-Identifier: GPL-3.0-or-later
"""SPI, I2C and pulses of the AVR firmware on an emulated chip."""

import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "firmware"))
from simboard import SimBoard  # noqa: E402

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not os.path.exists("/usr/include/simavr/sim_avr.h"),
                       reason="needs libsimavr-dev")]
MS = 16000
PORTS = {"atmega2560": "F", "atmega644p": "A"}


class AvrBoard(SimBoard):
    """Messages take their time on the wire."""

    def send_raw(self, data):
        self.ops.rx(self.clock, data, len(data))
        self.run(self.clock + 8 * MS)

    def _tx(self, ctx, clock, buf, size):
        """Bytes come one by one: pass on whole blocks."""
        self.partial = getattr(self, "partial", b"") + bytes(buf[:size])
        size = self.partial[0]
        if len(self.partial) >= size:
            block, self.partial = self.partial[:size], self.partial[size:]
            super()._tx(ctx, clock, block, size)


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    """Path of the shared object that wraps libsimavr with its buses."""
    path = tmp_path_factory.mktemp("simavr") / "simavr_bus.so"
    subprocess.run(
        ["cc", "-std=gnu11", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra",
         "-Werror", "-I", str(ROOT / "klippy_ext" / "csrc"),
         "-I", "/usr/include/simavr",
         str(ROOT / "test/emulator/simavr_vmcu.c"),
         str(ROOT / "test/emulator/simavr_bus.c"), "-o", str(path),
         "-lsimavr", "-lelf"], check=True)
    return path


@pytest.fixture(scope="module", params=PORTS)
def chip(request, tmp_path_factory):
    """(name of the chip, its firmware)"""
    out = tmp_path_factory.mktemp("avr")
    subprocess.run(
        ["make", "firmware", "OUT=%s/" % (out,),
         "KCONFIG_CONFIG=test/configs/%s.config" % (request.param,),
         "PYTHON=" + sys.executable], cwd=ROOT, check=True,
        capture_output=True)
    return request.param, out / "klipper.elf"


@pytest.fixture
def board(chip, adapter, monkeypatch):
    monkeypatch.setenv("SIMAVR_ELF", str(chip[1]))
    monkeypatch.setenv("SIMAVR_MCU", chip[0])
    monkeypatch.setenv("SIMAVR_ADC_PORT", str(ord(PORTS[chip[0]])))
    board = AvrBoard(adapter)
    board.run(10 * MS)
    board.identify()
    return board


def find_pin(board, name):
    """Number of a pin such as PB4, through the dictionary's ranges."""
    for first, number in board.dictionary["enumerations"]["pin"].items():
        start, count = number if isinstance(number, list) else (number, 1)
        offset = int(name[2:]) - int(first[2:])
        if name[:2] == first[:2] and 0 <= offset < count:
            return start + offset
    raise KeyError(name)


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
