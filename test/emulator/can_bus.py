# SPDX-License-Identifier: GPL-3.0-or-later
"""A CAN bus between emulated chips and a host, frame by frame.

The frame with the lowest id goes first, takes its bits' time, and is acknowledged
by any other controller that is on (ISO 11898-1).
"""

import collections
import ctypes
import struct

from unicorn_board import UnicornBoard

SENT, LOST, NO_ACK, BIT_ERROR = range(4)
ADMIN, ADMIN_REPLY = 0x3F0, 0x3F1
GS_FRAME = struct.Struct("<IIBBBB8s")
NO_ECHO = 0xFFFFFFFF
SLICE = 20e-6           # s between looks at controllers that wait


class Frame(ctypes.Structure):
    _fields_ = [("id", ctypes.c_uint32), ("len", ctypes.c_uint32),
                ("data", ctypes.c_uint8 * 8)]


class CanBoard(UnicornBoard):
    """A chip whose console is on the bus; `uuid` is what it calls itself."""

    bus = node = None

    def feed(self, data):
        """Data of this node has reached the host."""
        buf = (ctypes.c_uint8 * 8)(*data)
        UnicornBoard._tx(self, None, self.clock, buf, len(data))

    def send_raw(self, data):
        for i in range(0, len(data), 8):
            self.bus.send(256 + 2 * self.node, data[i:i + 8])
        self.bus.run_for(0.004)


class CanBus:
    """Boards and a host; frames that the host sees are in `seen`."""

    def __init__(self, boards, bit_rate=1000000):
        self.boards, self.bit_rate = boards, bit_rate
        self.waiting, self.seen = collections.deque(), []
        self.has_host = True
        self.is_shorted = False
        self.n_lost = 0
        for board in boards:
            board.bus = self

    def send(self, frame_id, data=b""):
        frame = Frame(frame_id, len(data))
        frame.data[:len(data)] = data
        self.waiting.append(frame)

    def _list_senders(self):
        senders = []
        for board in self.boards:
            frame = Frame()
            if board.library.unicorn_can_peek(ctypes.byref(frame)):
                rate = board.library.unicorn_can_bit_rate()
                assert rate == self.bit_rate, rate
                senders.append((frame, board))
        if self.waiting:
            senders.append((self.waiting[0], None))
        return sorted(senders, key=lambda s: s[0].id)

    def _pass_time(self, bits):
        for board in self.boards:
            board.run_for(bits / self.bit_rate)

    def _end(self, board, outcome):
        if board is not None:
            board.library.unicorn_can_end(outcome)
        elif outcome == SENT:
            self.waiting.popleft()

    def _deliver(self, frame, sender):
        acks = [bool(board.library.unicorn_can_deliver(ctypes.byref(frame)))
                for board in self.boards if board is not sender]
        if sender is not None and self.has_host:
            self.note(frame)
            acks.append(True)
        return any(acks)

    def note(self, frame):
        """The host has received a frame."""
        data = bytes(frame.data[:frame.len])
        self.seen.append((frame.id, data))
        for board in self.boards:
            if board.node is not None and frame.id == 257 + 2 * board.node:
                board.feed(data)

    def step(self):
        """One frame, or a pause."""
        senders = self._list_senders()
        if not senders:
            bits = round(SLICE * self.bit_rate)
            self._pass_time(bits)
            for board in self.boards:
                board.library.unicorn_can_idle(bits)
            return
        (frame, winner), *others = senders
        for _, loser in others:
            self._end(loser, LOST)
            self.n_lost += 1
        self._pass_time(47 + 8 * frame.len + 8)
        if self.is_shorted:
            self._end(winner, BIT_ERROR)
            return
        acked = self._deliver(frame, winner)
        self._end(winner, SENT if acked else NO_ACK)

    def run_for(self, seconds):
        board = self.boards[0]
        end = board.clock + seconds * board.freq
        while board.clock < end:
            self.step()

    def query(self):
        """Uuids of the nodes that have no number."""
        begin = len(self.seen)
        self.send(ADMIN, b"\x00")
        self.run_for(0.005)
        return [data[1:7] for frame_id, data in self.seen[begin:]
                if frame_id == ADMIN_REPLY and data[0] == 0x20 and data[7] == 1]

    def set_node(self, board, uuid, node):
        self.send(ADMIN, b"\x01" + uuid + bytes([node]))
        board.node = node
        self.run_for(0.005)


class BridgeBoard(CanBoard):
    """A chip on USB and on the bus: frames come out of it as gs_usb has them."""

    def __init__(self, library):
        self.stream, self.echoes = b"", []
        super().__init__(library)

    def _tx(self, ctx, clock, buf, size):
        self.stream += bytes(buf[:size])
        while len(self.stream) >= GS_FRAME.size:
            echo, frame_id, size, *_, data = GS_FRAME.unpack(
                self.stream[:GS_FRAME.size])
            self.stream = self.stream[GS_FRAME.size:]
            if echo != NO_ECHO:
                self.echoes.append(echo)
                continue
            frame = Frame(frame_id, size)
            frame.data[:] = data
            self.bus.note(frame)


class BridgedBus(CanBus):
    """The host is behind the first board, on USB."""

    def __init__(self, boards, bit_rate=1000000):
        super().__init__(boards, bit_rate)
        self.has_host = False
        self.n_sent = 0

    def send(self, frame_id, data=b""):
        bridge = self.boards[0]
        assert bridge.ops.rx(bridge.clock, GS_FRAME.pack(
            self.n_sent, frame_id, len(data), 0, 0, 0, data), GS_FRAME.size)
        self.n_sent += 1
