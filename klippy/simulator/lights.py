# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of leds at the pins of a simulated board, read pulse by pulse.

They decode what is at the pins, by the limits of the data sheets, and know nothing
of how it came there.
"""
import re

# WS2812B, SK6812: a high pulse longer than this (s) is a 1
ONE_TIME = 0.0000005
# A low time of so long (s) ends a transmission
RESET_TIME = 0.000009


class NeopixelStrip:
    """A chain of leds on one pin; colors as sent, bytes in the order of the wire."""

    def __init__(self, mcu, pin, n_bytes):
        """n_bytes: of the whole chain; what comes behind leaves the last led."""
        self.mcu, self.n_bytes = mcu, n_bytes
        self.edges = mcu.watch_edges([pin])
        self.data = bytes(n_bytes)
        self.n_updates = 0
        self.bits = []
        self.rise = self.fall = None

    def read(self):
        """Bytes that the chain shows now."""
        for clock, _, level in self.edges.take():
            self._note_edge(clock, level)
        self._latch()
        return self.data

    def _note_edge(self, clock, level):
        if level:
            if self.fall is not None and (
                    clock - self.fall > RESET_TIME * self.mcu.freq):
                self._latch()
            self.rise = clock
        elif self.rise is not None:
            self.bits.append(clock - self.rise > ONE_TIME * self.mcu.freq)
            self.fall = clock

    def _latch(self):
        """The pause at the end of a transmission: leds show what they got."""
        bits, self.bits = self.bits, []
        got = bytes(
            int("".join("01"[bit] for bit in bits[i:i + 8]), 2)
            for i in range(0, len(bits) - 7, 8))[:self.n_bytes]
        if got:
            self.n_updates += 1
            self.data = got + self.data[len(got):]


class DotstarStrip:
    """A chain of APA102 on a data and a clock pin: data counts as the clock rises."""

    def __init__(self, mcu, data_pin, clock_pin, count):
        self.data_pin, self.clock_pin, self.count = data_pin, clock_pin, count
        self.edges = mcu.watch_edges([data_pin, clock_pin])
        self.level = 0
        self.bits = ""

    def read(self):
        """[(brightness 0..31, red, green, blue)] that the leds show now."""
        for _, pin, level in self.edges.take():
            if pin == self.data_pin:
                self.level = int(level)
            elif level:
                self.bits += "01"[self.level]
        found = re.findall(r"0{32,}((?:111[01]{29}){%d})" % (self.count,),
                           self.bits)
        frames = found[-1] if found else ""
        return [read_apa102(frames[i:i + 32]) for i in range(0, len(frames), 32)]


def read_apa102(bits):
    """(brightness, red, green, blue) of the 32 bits for one led."""
    blue, green, red = (int(bits[i:i + 8], 2) for i in (8, 16, 24))
    return int(bits[3:8], 2), red, green, blue
