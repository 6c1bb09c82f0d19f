# SPDX-License-Identifier: GPL-3.0-or-later
"""A CAN bus bit by bit: one emulated chip, and nodes that do what the standard says.

The first node is the host's interface.  Others may have clocks that are off, jitter,
or send frames with a wrong bit.  `unicorn_canwire.c` has them.
"""

import collections
import ctypes

from can_bus import GS_FRAME, CanBoard, CanBus, Frame

EXTENDED, REMOTE = 1 << 31, 1 << 30
WireStats = collections.namedtuple(
    "WireStats", "errors sent lost overloads no_ack dropped waiting dominant")
CoreStats = collections.namedtuple(
    "CoreStats", "most_cycles waits overruns instructions awake cycles")
STEP = 50e-6            # s between looks at what the host has received


def make_frame(frame_id, data=b"", size=None):
    frame = Frame(frame_id, len(data) if size is None else size)
    frame.data[:len(data)] = data
    return frame


class WireBoard(CanBoard):
    """A chip whose console is on such a bus, which may be slow."""

    def send_raw(self, data):
        super().send_raw(data)
        self.bus.run_for(0.004 * (1e6 / self.bus.bit_rate - 1))


class WireBus(CanBus):
    """delay: cycles that a transceiver takes each way.  ppm: of the host's clock."""

    def __init__(self, board, bit_rate=1000000, ppm=0, jitter=0, delay=14, pins=(4, 5)):
        super().__init__([board], bit_rate)
        self.library = board.library
        self.library.unicorn_wire_begin(*pins, delay)
        self.host = self.add(ppm, jitter)
        board.run_for(30 / bit_rate)

    def add(self, ppm=0, jitter=0, is_mute=False):
        """One more node; returns its number."""
        return self.library.unicorn_wire_add(self.bit_rate, ppm, jitter, is_mute)

    def send(self, frame_id, data=b"", node=0, flip=-1, size=None):
        frame = make_frame(frame_id, data, size)
        self.library.unicorn_wire_send(node, ctypes.byref(frame), flip)

    def receive(self, node=0):
        """Frames that a node has received since the last call."""
        frames, frame = [], Frame()
        while self.library.unicorn_wire_receive(node, ctypes.byref(frame)):
            frames.append((frame.id, bytes(frame.data[:frame.len])))
            if node == self.host:
                self.note(frame)
        return frames

    def read_stats(self, node=0):
        stats = (ctypes.c_uint64 * 8)()
        self.library.unicorn_wire_read(node, stats)
        return WireStats(*stats)

    def read_core(self):
        """Of PIO and the second core; the extremes since the last call."""
        stats = (ctypes.c_uint64 * 6)()
        self.library.unicorn_core1_read(stats)
        return CoreStats(*stats)

    def break_wire(self, is_shorted=False, is_open=False):
        self.library.unicorn_wire_break(is_shorted, is_open)

    def step(self):
        self.boards[0].run_for(STEP)
        self.receive()


class WireBridge(WireBus):
    """The chip is the host's adapter, on USB; all nodes are others.

    What comes out of USB is in `seen`, as (id with Linux's flags, data).
    """

    def __init__(self, board, *args, **kwargs):
        super().__init__(board, *args, **kwargs)
        self.n_sent = 0

    def send(self, frame_id, data=b"", size=None):
        bridge = self.boards[0]
        packet = GS_FRAME.pack(self.n_sent, frame_id, len(data) if size is None
                               else size, 0, 0, 0, data)
        assert bridge.ops.rx(bridge.clock, packet, GS_FRAME.size)
        self.n_sent += 1

    def send_from(self, node, frame_id, data=b"", flip=-1, size=None):
        super().send(frame_id, data, node, flip, size)

    def step(self):
        self.boards[0].run_for(STEP)
