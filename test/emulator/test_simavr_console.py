# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to talk to an emulated AVR chip: each UART, each speed, native USB."""

import ctypes

import pytest
import simavr_chip
from simavr_board import AvrBoard
from simboard import frame

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]

# Configuration, number of the UART, Hz
LINES = [("atmega2560", 1, 16), ("atmega2560", 2, 8), ("atmega2560", 3, 16),
         ("atmega1284p", 1, 20), ("atmega328p", 0, 20), ("atmega168", 0, 8)]
SET_LINE_CODING = bytes([0x21, 0x20, 0, 0, 0, 0, 7, 0])
SET_LINE_STATE = bytes([0x21, 0x22, 0, 0, 0, 0, 0, 0])
UBRRL = {0: 0xC4, 1: 0xCC, 2: 0xD4, 3: 0x134}


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return simavr_chip.build_adapter(tmp_path_factory.mktemp("simavr"))


@pytest.mark.parametrize(("chip", "uart", "mhz"), LINES)
def test_uart(chip, uart, mhz, adapter, tmp_path, monkeypatch):
    elf = simavr_chip.build_firmware(tmp_path, chip, (
        "LOW_LEVEL_OPTIONS=y", "AVR_SERIAL_UART%d=y" % (uart,),
        "AVR_FREQ_%d000000=y" % (mhz,)))
    simavr_chip.choose_chip(monkeypatch, elf, chip)
    monkeypatch.setenv("SIMAVR_UART", str(uart))
    monkeypatch.setenv("SIMAVR_HZ", str(mhz * 1000000))
    board = AvrBoard(adapter)
    constants = board.dictionary["config"]
    assert constants["CLOCK_FREQ"] == mhz * 1000000
    pins = {0: "PD0,PD1" if mhz != 16 else "PE0,PE1", 1: "PD2,PD3", 2: "PH0,PH1",
            3: "PJ0,PJ1"}
    assert constants["RESERVE_PINS_serial"] == pins[uart]
    divisor = board.query("debug_read", "debug_result", order=0, addr=UBRRL[uart])
    assert mhz * 1000000 / 8 / (divisor["val"] + 1) == 250000


class Record(ctypes.Structure):
    """A control transfer that the emulated host has made."""

    _fields_ = [("setup", ctypes.c_uint8 * 8), ("len", ctypes.c_int32),
                ("data", ctypes.c_uint8 * 256)]


def list_transfers(board):
    """(setup packet, data or None if refused) of each control transfer."""
    count = ctypes.c_uint32.in_dll(board.library, "simavr_usb_n_records").value
    records = (Record * 32).in_dll(board.library, "simavr_usb_records")
    return [(bytes(r.setup), None if r.len < 0 else bytes(r.data[:r.len]))
            for r in records[:count]]


def request(board, setup, line=bytes(7)):
    board.library.simavr_usb_request(setup, line)
    board.run_for(0.005)


@pytest.fixture(params=["atmega32u4", "at90usb1286"])
def usb_board(request, adapter, tmp_path, monkeypatch):
    elf = simavr_chip.build_firmware(tmp_path, request.param)
    simavr_chip.choose_chip(monkeypatch, elf, request.param)
    return AvrBoard(adapter)


def read_text(descriptor):
    assert descriptor[0] == len(descriptor) and descriptor[1] == 3
    return descriptor[2:].decode("utf-16-le")


def test_usb_enumeration(usb_board):
    transfers = list_transfers(usb_board)
    found = {setup[2:4]: data for setup, data in transfers if setup[1] == 6}
    device = found[b"\x00\x01"]
    assert device[:2] == bytes([18, 1]) and len(device) == 18
    assert device[8:12] == bytes.fromhex("501d4e61")
    config = found[b"\x00\x02"]
    assert len(config) == int.from_bytes(config[2:4], "little") and config[4] == 2
    pos, kinds = 0, []
    while pos < len(config):
        kinds.append(config[pos + 1])
        pos += config[pos]
    assert pos == len(config)
    assert kinds == [2, 4, 0x24, 0x24, 0x24, 5, 4, 5, 5]
    assert read_text(found[b"\x01\x03"]) == "Klipper"
    assert read_text(found[b"\x02\x03"]) == usb_board.dictionary["config"]["MCU"]
    assert read_text(found[b"\x03\x03"]) == "12345"
    assert found[b"\x09\x03"] is None
    assert found[b"\x00\x03"] == bytes([4, 3, 9, 4])
    line = [data for setup, data in transfers if setup[:2] == b"\xa1\x21"]
    assert line == [bytes.fromhex("90d00300000008")]
    assert transfers[-1][1] == b"\x01\x00"


def test_usb_takes_no_more_than_it_has_room_for(usb_board):
    """More at once than it can keep: none is lost, all are answered."""
    n = len(usb_board.messages)
    ping = usb_board.commands["debug_ping"].encode({"data": b"0123456789" * 4})
    usb_board.send_raw(b"".join(
        frame(usb_board.seq + i, ping) for i in range(16)))
    usb_board.run_for(0.05)
    answers = usb_board.list_messages("pong", n)
    assert [a["data"] for a in answers] == [b"0123456789" * 4] * 16


def test_usb_touch_starts_the_boot_loader(adapter, tmp_path, monkeypatch):
    """Closed at 1200 baud: off the bus, a key in memory, a watchdog reset."""
    elf = simavr_chip.build_firmware(tmp_path, "atmega32u4")
    simavr_chip.choose_chip(monkeypatch, elf, "atmega32u4")
    board = AvrBoard(adapter)
    board.configure()
    before = len(list_transfers(board))
    request(board, SET_LINE_CODING, (250000).to_bytes(4, "little") + b"\0\0\x08")
    request(board, SET_LINE_STATE)
    assert board.query("get_config", "config")["is_config"] == 1
    request(board, SET_LINE_CODING, (1200).to_bytes(4, "little") + b"\0\0\x08")
    request(board, SET_LINE_STATE)
    assert len(list_transfers(board)) == before + 4
    # (libsimavr keeps the watchdog's time that was set first)
    board.run_for(0.7)
    board.seq, board.partial = 0, b""
    assert board.query("get_config", "config")["is_config"] == 0
