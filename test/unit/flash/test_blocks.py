# SPDX-License-Identifier: GPL-3.0-or-later
"""The block protocol, against a boot loader that is written apart from it."""

import socket
import struct
import threading

import pytest

from klippy.errors import PrinterError
from klippy.flash import methods, streams
from klippy.flash.target import Target

IMAGE = bytes(i * 5 & 0xFF for i in range(1000))
START, SIZE = 0x08002000, 64
UUID = bytes.fromhex("0123456789ab")
FRAME = streams.FRAME


def slow_crc(data):
    """Bit-reversed polynomial 0x1021, a different way than the program's."""
    crc = 0xFFFF
    for byte in data:
        crc ^= int("{:08b}".format(byte)[::-1], 2) << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return int("{:016b}".format(crc)[::-1], 2)


class FakeLoader:
    """Takes whole messages; `faults` are returned instead of an answer."""

    def __init__(self, mcu=b"stm32f103xe"):
        self.memory, self.mcu, self.faults = {}, mcu, []
        self.seen, self.running = [], False

    def answer(self, message):
        command, words = message[2], message[3]
        body = message[2:4 + 4 * words]
        assert message[:2] == b"\x01\x88" and message[-2:] == b"\x99\x03"
        assert struct.unpack("<H", message[-4:-2])[0] == slow_crc(body)
        self.seen.append(command)
        if self.faults:
            return self.faults.pop(0)
        return self.make(0xA0, struct.pack("<I", command)
                         + self.obey(command, body[2:]))

    def make(self, kind, payload):
        body = bytes([kind, len(payload) // 4]) + payload
        return b"\x01\x88" + body + struct.pack("<H", slow_crc(body)) + b"\x99\x03"

    def obey(self, command, payload):
        if command == 0x11:
            return (struct.pack("<III", 0x10000, START, SIZE)
                    + self.mcu.ljust(12, b"\0"))
        if command == 0x12:
            self.memory[struct.unpack("<I", payload[:4])[0]] = payload[4:]
            return payload[:4]
        if command == 0x14:
            return payload[:4] + self.memory[struct.unpack("<I", payload[:4])[0]]
        self.running |= command == 0x15
        return b""


class Stream:
    def __init__(self, loader):
        self.loader, self.out = loader, b""

    def send(self, data):
        self.out += self.loader.answer(data)

    def receive(self, timeout):
        part, self.out = self.out[:7], self.out[7:]
        return part

    def close(self):
        pass


def make_target(tmp_path, start=START, mcu="stm32f103xe"):
    (tmp_path / "klipper.bin").write_bytes(IMAGE)
    return Target(tmp_path, {"MCU": mcu, "BOARD_DIRECTORY": "stm32",
                             "FLASH_APPLICATION_ADDRESS": hex(start)})


def read_back(loader):
    return b"".join(loader.memory[a] for a in sorted(loader.memory))


def test_writes_verifies_and_starts(tmp_path):
    loader = FakeLoader()
    methods.write_blocks(make_target(tmp_path), Stream(loader))
    assert read_back(loader)[:1000] == IMAGE
    assert min(loader.memory) == START and loader.running
    assert set(read_back(loader)[1000:]) == {0xFF}


def test_repeats_what_is_lost_or_refused(tmp_path):
    loader = FakeLoader()
    good = loader.make(0xA0, struct.pack("<I", 0x11))
    loader.faults = [b"", loader.make(0xF1, b""), good[:6] + b"x" + good[7:], b"junk"]
    methods.write_blocks(make_target(tmp_path), Stream(loader))
    assert read_back(loader)[:1000] == IMAGE and loader.seen[:5] == [0x11] * 5


@pytest.mark.parametrize(("change", "words"), [
    (dict(start=0x08000000), "starts firmware at 0x8002000"),
    (dict(mcu="stm32f407xx"), "The board has an stm32f103xe"),
])
def test_wrong_firmware_is_not_written(tmp_path, change, words):
    loader = FakeLoader()
    with pytest.raises(PrinterError, match=words):
        methods.write_blocks(make_target(tmp_path, **change), Stream(loader))
    assert not loader.memory


def test_worn_flash_is_noticed(tmp_path):
    loader = FakeLoader()
    plain = loader.obey
    loader.obey = lambda c, p: (plain(c, p) if c != 0x14
                                else plain(c, p)[:-1] + b"\x01")
    with pytest.raises(PrinterError, match="reads back wrong"):
        methods.write_blocks(make_target(tmp_path), Stream(loader))


def test_silence_and_refusal_end(tmp_path):
    loader = FakeLoader()
    loader.faults = [b""] * 5
    with pytest.raises(PrinterError, match="does not answer to: connect"):
        methods.write_blocks(make_target(tmp_path), Stream(loader))
    loader.faults = [loader.make(0xF2, struct.pack("<I", 0x11))]
    with pytest.raises(PrinterError, match="refuses to connect"):
        methods.write_blocks(make_target(tmp_path), Stream(loader))


class CanBoard(threading.Thread):
    """Firmware with a uuid that starts its boot loader when asked to."""

    def __init__(self, bus, loader):
        super().__init__(daemon=True)
        self.bus, self.loader = bus, loader
        self.node, self.data, self.booted = None, b"", False

    def run(self):
        while True:
            frame = self.bus.recv(FRAME.size)
            if not frame:
                return
            can_id, size, data = FRAME.unpack(frame)
            self.take(can_id, data[:size])

    def take(self, can_id, data):
        if can_id == 0x3F0 and data == b"\x02" + UUID:
            self.booted = True
        elif can_id == 0x3F0 and data[:7] == b"\x11" + UUID and self.booted:
            self.node = 0x100 + 2 * data[7]
        elif can_id == self.node:
            self.data += data
            if self.data.endswith(b"\x99\x03") and \
                    len(self.data) == 8 + 4 * self.data[3]:
                message, self.data = self.data, b""
                answer = self.loader.answer(message)
                for i in range(0, len(answer), 8):
                    part = answer[i:i + 8]
                    self.bus.send(FRAME.pack(self.node + 1, len(part), part))


def test_can_board(tmp_path, monkeypatch):
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    loader = FakeLoader()
    board = CanBoard(there, loader)
    board.start()
    monkeypatch.setattr(streams, "ENTER_WAIT", 0.01)
    stream = streams.CanStream("can0", UUID.hex(), here)
    methods.write_blocks(make_target(tmp_path), stream)
    board.join()
    assert read_back(loader)[:1000] == IMAGE and loader.running


def test_bad_uuid():
    with pytest.raises(PrinterError, match="12 hex digits"):
        streams.CanStream("can0", "xyz", object())
