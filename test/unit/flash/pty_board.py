# SPDX-License-Identifier: GPL-3.0-or-later
"""Boot loaders on a pseudo terminal, for the programs that write to boards."""

import contextlib
import os
import select
import termios
import threading
import tty


class PtyBoard(threading.Thread):
    """Answers what arrives at `path` by serve(), until close()."""

    def __init__(self):
        super().__init__(daemon=True)
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave, termios.TCSANOW)
        self.path = os.ttyname(self.slave)
        self.memory = bytearray(b"\xff" * 0x40000)
        self.stop_read, self.stop_write = os.pipe()
        self.pending = b""

    def take(self, count):
        """The next bytes; EOFError once closed."""
        while len(self.pending) < count:
            ready, _, _ = select.select([self.master, self.stop_read], [], [])
            if self.stop_read in ready:
                raise EOFError
            self.pending += os.read(self.master, 4096)
        data, self.pending = self.pending[:count], self.pending[count:]
        return data

    def give(self, data):
        os.write(self.master, bytes(data))

    def run(self):
        with contextlib.suppress(EOFError, OSError):
            while True:
                self.serve()

    def close(self):
        os.write(self.stop_write, b"x")
        self.join()
        for fd in (self.master, self.slave, self.stop_read, self.stop_write):
            os.close(fd)


class ArduinoBoard(PtyBoard):
    """STK500 version 1, the protocol of avrdude's `arduino`, as on an Uno."""

    SIGNATURE = bytes([0x1E, 0x95, 0x0F])
    ARGUMENTS = {0x30: 0, 0x41: 1, 0x42: 20, 0x45: 5, 0x50: 0, 0x51: 0, 0x55: 2,
                 0x56: 4, 0x75: 0}

    def __init__(self):
        super().__init__()
        self.address, self.left = 0, False

    def serve(self):
        command, = self.take(1)
        if command == 0x64:
            self._write_page()
        elif command == 0x74:
            self._read_page()
        elif command in self.ARGUMENTS:
            args = self.take(self.ARGUMENTS[command])
            if self.take(1) == b"\x20":
                self.give(b"\x14" + self._answer(command, args) + b"\x10")

    def _answer(self, command, args):
        if command == 0x55:
            self.address = 2 * int.from_bytes(args, "little")
        self.left |= command == 0x51
        if command == 0x75:
            return self.SIGNATURE
        return {0x41: b"\x03", 0x56: b"\x00"}.get(command, b"")

    def _write_page(self):
        size = int.from_bytes(self.take(2), "big")
        assert self.take(1) == b"F"
        self.memory[self.address:self.address + size] = self.take(size)
        self.take(1)
        self.give(b"\x14\x10")

    def _read_page(self):
        size = int.from_bytes(self.take(2), "big")
        self.take(2)
        self.give(b"\x14" + self.memory[self.address:self.address + size] + b"\x10")


class Stm32Board(PtyBoard):
    """The serial boot loader of an STM32F103 (ST's note AN3155)."""

    BASE = 0x08000000
    ACK = b"\x79"
    COMMANDS = bytes([0x00, 0x01, 0x02, 0x11, 0x21, 0x31, 0x43])

    def __init__(self):
        super().__init__()
        self.started_at, self.started = None, threading.Event()

    def _take_address(self):
        data = self.take(5)
        self.give(self.ACK)
        return int.from_bytes(data[:4], "big")

    def serve(self):
        command, = self.take(1)
        if command == 0x7F:
            self.give(self.ACK)
            return
        self.take(1)
        self.give(self.ACK)
        if command == 0x00:
            self.give(bytes([len(self.COMMANDS), 0x22]) + self.COMMANDS + self.ACK)
        elif command == 0x01:
            self.give(b"\x22\x00\x00" + self.ACK)
        elif command == 0x02:
            self.give(b"\x01\x04\x10" + self.ACK)
        elif command == 0x11:
            self._read()
        elif command == 0x21:
            self.started_at = self._take_address()
            self.started.set()
        elif command == 0x31:
            self._write()
        elif command == 0x43:
            count, = self.take(1)
            self.take(1 if count == 0xFF else count + 2)
            self.give(self.ACK)

    def _read(self):
        start = self._take_address() - self.BASE
        count, _ = self.take(2)
        self.give(self.ACK + (self.memory[start:start + count + 1]
                              if start >= 0 else bytes(count + 1)))

    def _write(self):
        start = self._take_address() - self.BASE
        count, = self.take(1)
        data = self.take(count + 1)
        self.take(1)
        self.memory[start:start + count + 1] = data
        self.give(self.ACK)
