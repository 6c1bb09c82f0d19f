# SPDX-License-Identifier: GPL-3.0-or-later
"""The other ends of links, for tests: a slow mcu in Python, a toy mcu in C."""

import pathlib
import select
import subprocess
import tempfile

from klippy_ext.serialqueue import CommandQueue, SerialQueue

ROOT = pathlib.Path(__file__).resolve().parents[2]
CSRC = ROOT / "klippy_ext" / "csrc"
SYNC = 0x7E


def slow_crc(data):
    """CRC16-CCITT one bit at a time."""
    crc = 0xFFFF
    for byte in data:
        for bit in range(8):
            carry = (crc ^ byte >> bit) & 1
            crc = crc >> 1 ^ (0x8408 if carry else 0)
    return crc


def slow_int(value):
    """Variable length quantity of an integer, by the table of ranges."""
    value = (value + (1 << 31)) % (1 << 32) - (1 << 31)
    ranges = [(-32, 96), (-4096, 12288), (-524288, 1572864),
              (-67108864, 201326592)]
    sizes = [n for n, (low, high) in enumerate(ranges, 1) if low <= value < high]
    size = min(sizes, default=5)
    if size == 5:
        value &= 0xFFFFFFFF
    return bytes([(value >> 7 * n & 0x7F) | (0x80 if n else 0)
                  for n in range(size - 1, -1, -1)])


def slow_block(seq, payload=b""):
    block = bytes([len(payload) + 5, 0x10 | seq % 16]) + payload
    crc = slow_crc(block)
    return block + bytes([crc >> 8, crc & 255, SYNC])


def read_ints(data, count, pos=0):
    """(list of integers, position behind)."""
    values = []
    for _ in range(count):
        value = data[pos] & 0x7F
        value -= 0x80 if value >= 0x60 else 0
        while data[pos] & 0x80:
            pos += 1
            value = value * 128 + (data[pos] & 0x7F)
        pos += 1
        values.append(value & 0xFFFFFFFF)
    return values, pos


class SlowPeer:
    """An mcu's protocol as the specification words it, over a socket."""

    def __init__(self, sock, expected=3):
        self.sock = sock
        self.expected = expected
        self.pending = b""
        self.payloads = []
        self.sizes = []

    def read_block(self, timeout=5.):
        """Next block from the host: (seq, payload), None after timeout s."""
        while True:
            block = self._cut_block()
            if block is not None:
                return block
            if not select.select([self.sock], [], [], timeout)[0]:
                return None
            data = self.sock.recv(4096)
            if not data:
                return None
            self.pending += data

    def _cut_block(self):
        while self.pending:
            size = self.pending[0]
            if not 5 <= size <= 64:
                self.pending = self.pending[1:]
                continue
            if len(self.pending) < size:
                return None
            block, self.pending = self.pending[:size], self.pending[size:]
            assert block == slow_block(block[1], block[2:-3])
            return block[1] & 15, block[2:-3]
        return None

    def send(self, payload=b"", seq=None):
        self.sock.sendall(
            slow_block(self.expected if seq is None else seq, payload))

    def serve_block(self, timeout=5., ack=True):
        """Take one block as an mcu does; returns its payload if it is new."""
        got = self.read_block(timeout)
        if got is None:
            return None
        seq, payload = got
        is_new = seq == self.expected
        if is_new:
            self.expected = (self.expected + 1) % 16
            self.payloads.append(payload)
            self.sizes.append(len(payload) + 5)
        if ack:
            self.send()
        return payload if is_new else b""

    def serve_until(self, size):
        """Serve until that many payload bytes have come; returns them."""
        while sum(map(len, self.payloads)) < size:
            assert self.serve_block() is not None, "the host fell silent"
        return b"".join(self.payloads)


def build_echo(folder=None):
    """Compile the toy mcu; returns the path of its library."""
    folder = pathlib.Path(folder or tempfile.mkdtemp())
    library = folder / "echo_vmcu.so"
    subprocess.run(
        ["cc", "-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-fPIC",
         "-shared", "-fvisibility=default", "-I", str(CSRC), "-o",
         str(library), str(ROOT / "test/c/echo_vmcu.c"),
         str(CSRC / "msgblock.c")], check=True)
    return library


class EchoMcu:
    """The toy mcu in a world, with a serial queue to it."""

    def __init__(self, world, library, name="mcu", **options):
        self.world = world
        self.mcu = world.add_mcu(name, library, **options)
        self.link = self.mcu.link
        self.queue = SerialQueue.open_virtual(world, self.link)
        self.cq = self.queue.alloc_command_queue()
        self.question_cq = CommandQueue()

    def send(self, *values, cq=None, minclock=0, reqclock=0, notify_id=0):
        self.queue.send(cq or self.cq, b"".join(map(slow_int, values)),
                        minclock, reqclock, notify_id)

    def log(self, data, cq=None, minclock=0, reqclock=0, notify_id=0):
        self.queue.send(cq or self.cq, bytes([1, len(data)]) + data,
                        minclock, reqclock, notify_id)

    def pull_until(self, accept, seconds=2.):
        """The first pulled entry that accept() takes, None after seconds."""
        limit = self.world.monotonic() + seconds
        while True:
            while (entry := self.queue.pull()) is not None:
                if accept(entry):
                    return entry
            if self.world.monotonic() >= limit:
                return None
            self.world.advance(limit)

    def ask(self, count, *values):
        """Send a question until it is answered; the answer's integers."""
        for _ in range(50):
            self.send(*values, cq=self.question_cq)
            entry = self.pull_until(
                lambda e: e[0][:1] == bytes([values[0]]), 0.5)
            if entry is not None:
                return read_ints(entry[0], count)[0], entry
        raise AssertionError("no answer to %r" % (values,))

    def read_log(self):
        """All that was logged: list of (clock, bytes)."""
        (_, n_entries, *_), _ = self.ask(5, 9)
        entries = []
        while len(entries) < n_entries:
            (_, index, low, high, _), entry = self.ask(5, 2, len(entries))
            if index == len(entries):
                pos = read_ints(entry[0], 5)[1]
                entries.append((low + (high << 32), entry[0][pos:]))
        return entries

    def wait(self, seconds):
        limit = self.world.monotonic() + seconds
        while self.world.monotonic() < limit:
            self.world.advance(limit)
