# SPDX-License-Identifier: GPL-3.0-or-later
"""The block protocol of the boot loader that many CAN and USB boards have.

A message is 01 88, a command, the number of 32 bit words that follow, these, a
CRC of all from the command on, 99 03.  The answer is such a message whose
first word is the command.
"""

import hashlib
import struct

from klippy.errors import PrinterError

HEADER, TRAILER = b"\x01\x88", b"\x99\x03"
CONNECT, SEND_BLOCK, SEND_EOF, REQUEST_BLOCK, COMPLETE = range(0x11, 0x16)
ACK, NACK, ERROR = 0xA0, 0xF1, 0xF2
RETRIES = 5
NAMES = {CONNECT: "connect", SEND_BLOCK: "write a block", SEND_EOF: "end the file",
         REQUEST_BLOCK: "read a block", COMPLETE: "start the firmware"}


def crc16(data):
    """CRC-16-CCITT with the start value 0xffff, as the wire protocol's."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0x8408 if crc & 1 else crc >> 1
    return crc


def pack(command, payload=b""):
    """Bytes of a message; the payload is filled up to whole words."""
    payload = payload.ljust((len(payload) + 3) // 4 * 4, b"\0")
    body = bytes([command, len(payload) // 4]) + payload
    return HEADER + body + struct.pack("<H", crc16(body)) + TRAILER


def unpack(data):
    """(command, payload, rest) of the first whole message in `data`; command is
    None without one (rest: what may become one)."""
    while True:
        start = data.find(HEADER)
        if start < 0:
            return None, b"", data[-1:] if data.endswith(HEADER[:1]) else b""
        data = data[start:]
        if len(data) < 4 or len(data) < 8 + 4 * data[3]:
            return None, b"", data
        end = 4 + 4 * data[3]
        crc, = struct.unpack("<H", data[end:end + 2])
        if data[end + 2:end + 4] == TRAILER and crc == crc16(data[2:end]):
            return data[2], data[4:end], data[end + 4:]
        data = data[2:]


class BootLoader:
    """A board in its boot loader, behind a stream.

    stream: send(bytes), receive(seconds) -> bytes (b"" when none came).
    """

    def __init__(self, stream, timeout=2.0):
        self.stream, self.timeout = stream, timeout
        self.received = b""
        self.start = self.block_size = 0
        self.mcu = ""

    def _wait(self, command):
        """(kind, payload) of the next answer to a command, or None in time."""
        while True:
            kind, payload, self.received = unpack(self.received)
            if kind is None:
                more = self.stream.receive(self.timeout)
                if not more:
                    return None
                self.received += more
            elif kind == NACK:
                return kind, b""
            elif payload[:1] == bytes([command]):
                return kind, payload[4:]

    def ask(self, command, payload=b""):
        """Payload of the answer; PrinterError if there is no good one."""
        for _ in range(RETRIES):
            self.stream.send(pack(command, payload))
            answer = self._wait(command)
            if answer is None or answer[0] == NACK:
                continue
            if answer[0] == ACK:
                return answer[1]
            raise PrinterError("The boot loader refuses to %s" % (NAMES[command],))
        raise PrinterError("The boot loader does not answer to: %s" % (NAMES[command],))

    def connect(self):
        """Learn where its firmware begins and how large its blocks are."""
        answer = self.ask(CONNECT)
        if len(answer) < 12:
            raise PrinterError("The boot loader does not say what it is: %s"
                               % (answer.hex() or "no data",))
        self.start, self.block_size = struct.unpack("<II", answer[4:12])
        self.mcu = answer[12:].rstrip(b"\0").decode("ascii", "replace")

    def write(self, data, report=lambda done, total: None):
        """Write firmware and read it back; PrinterError if it differs."""
        size = self.block_size
        blocks = [data[i:i + size].ljust(size, b"\xff")
                  for i in range(0, len(data), size)]
        for i, block in enumerate(blocks):
            address = struct.pack("<I", self.start + i * size)
            if self.ask(SEND_BLOCK, address + block)[:4] != address:
                raise PrinterError("The boot loader wrote another block than 0x%x"
                                   % (self.start + i * size,))
            report(i + 1, len(blocks))
        self.ask(SEND_EOF)
        written, read = hashlib.sha1(), hashlib.sha1()
        for i, block in enumerate(blocks):
            address = struct.pack("<I", self.start + i * size)
            read.update(self.ask(REQUEST_BLOCK, address)[4:4 + size])
            written.update(block)
        if read.digest() != written.digest():
            raise PrinterError("The firmware reads back wrong: try again; if it"
                               " remains so the flash of the chip is worn")

    def start_firmware(self):
        """Leave the boot loader."""
        self.ask(COMPLETE)
