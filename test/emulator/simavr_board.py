# SPDX-License-Identifier: GPL-3.0-or-later
"""An emulated AVR chip, driven by hand over its real console."""

import ctypes
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "firmware"))
from simboard import SimBoard  # noqa: E402


class AvrBoard(SimBoard):
    """Boots and identifies itself; messages take their time on the wire."""

    def __init__(self, library):
        self.partial = b""
        super().__init__(library)
        self.run_for(0.06)
        self.identify()

    def send_raw(self, data):
        self.ops.rx(self.clock, data, len(data))
        self.run_for(0.008)

    def _tx(self, ctx, clock, buf, size):
        """Bytes come as they are sent: pass on whole blocks."""
        self.partial += bytes(buf[:size])
        while self.partial and len(self.partial) >= self.partial[0]:
            size = self.partial[0]
            block, self.partial = self.partial[:size], self.partial[size:]
            super()._tx(ctx, clock, block, size)

    def read_stack(self, kept):
        """Bytes of stack, of those that are kept for it, in use at most."""
        return self.library.simavr_stack_used(kept)

    def read_stats(self):
        """(cycles awake,) since power came on."""
        self.library.simavr_read_awake.restype = ctypes.c_uint64
        return (self.library.simavr_read_awake(),)

    def read_delays(self):
        """Cycles with interrupts off outside of any, cycles in one interrupt: the
        longest since the last call.  From the first one on the chip is watched,
        which makes it slow here."""
        delays = (ctypes.c_uint64 * 2)()
        self.library.simavr_read_delays(delays)
        return tuple(delays)


def find_pin(board, name):
    """Number of a pin such as PB4, through the dictionary's ranges."""
    for first, number in board.dictionary["enumerations"]["pin"].items():
        start, count = number if isinstance(number, list) else (number, 1)
        offset = int(name[2:]) - int(first[2:])
        if name[:2] == first[:2] and 0 <= offset < count:
            return start + offset
    raise KeyError(name)
