# SPDX-License-Identifier: GPL-3.0-or-later
"""The watcher's side of the linux firmware's fake board (src/linux/fake.h).

Needs nothing but the file that `klipper.elf --fake DIR` maps: sets inputs and
readings, sees levels, duties, edges and the steppers of DIR/rules.
"""

import mmap
import pathlib
import re
import struct
import time

MAGIC = b"fakemcu1"
GPIO_LINES, PWM_CHANNELS = 512, 16
PWM_FIRST, ANALOG_FIRST, PIN_COUNT = 0x1800, 0x1900, 0x1A00
STEPPERS, EDGES = 16, 65536
HEADER = struct.Struct("=8s4I2Q24x")
STEPPER = struct.Struct("=qQ")
PIN = struct.Struct("=3BbI4QI4x")
EDGE = struct.Struct("=Q2I")
STEPPER_AT = HEADER.size
PIN_AT = STEPPER_AT + STEPPER.size * STEPPERS
EDGE_AT = PIN_AT + PIN.size * PIN_COUNT
SIZE = EDGE_AT + EDGE.size * EDGES
INPUT_OFFSET, READING_OFFSET = 2, 40
PULL = 2
ADC_MAX = 4095
FREQ = 50000000


def find_pin(name):
    """Number of a pin: gpio17, gpiochip1/gpio2, pwmchip0/pwm1, analog3."""
    match = re.fullmatch(r"(?:gpiochip(\d+)/)?gpio(\d+)", name)
    if match:
        return int(match.group(1) or 0) * GPIO_LINES + int(match.group(2))
    match = re.fullmatch(r"pwmchip(\d+)/pwm(\d+)", name)
    if match:
        return PWM_FIRST + int(match.group(1)) * PWM_CHANNELS + int(match.group(2))
    match = re.fullmatch(r"analog(\d+)", name)
    if match:
        return ANALOG_FIRST + int(match.group(1))
    raise ValueError("%r is no pin of a linux process" % name)


class FakeIo:
    """The mapped state of one fake board; pins are named."""

    def __init__(self, folder):
        path = pathlib.Path(folder) / "board"
        with open(path, "r+b") as f:
            self.map = mmap.mmap(f.fileno(), SIZE)
        if self.map[:len(MAGIC)] != MAGIC:
            raise ValueError("%s is not the state of a fake board" % path)

    def close(self):
        self.map.close()

    def _header(self):
        return HEADER.unpack_from(self.map, 0)

    def _pin(self, name):
        return PIN.unpack_from(self.map, PIN_AT + PIN.size * find_pin(name))

    @property
    def boots(self):
        """How often the firmware has started on this board."""
        return self._header()[4]

    def read_clock(self):
        """64 bit clock of the mcu now."""
        return (time.monotonic_ns() - self._header()[5]) * FREQ // 10**9

    def set_input(self, name, level):
        """0, 1, or PULL for a pin that nothing but its pull drives."""
        self.map[PIN_AT + PIN.size * find_pin(name) + INPUT_OFFSET] = level

    def set_adc(self, name, fraction):
        """Reading of an analog input, 0..1 of full scale."""
        struct.pack_into("=I", self.map,
                         PIN_AT + PIN.size * find_pin(name) + READING_OFFSET,
                         round(fraction * ADC_MAX))

    def is_used(self, name):
        return self._pin(name)[0] != 0

    def level(self, name):
        return self._pin(name)[1]

    def edge_count(self, name):
        return self._pin(name)[4]

    def on_seconds(self, name):
        """Sum of the times at level 1 until now, for duty over a period."""
        _, level, _, _, _, changed, on_ticks, *_ = self._pin(name)
        if level:
            on_ticks += max(self.read_clock() - changed, 0)
        return on_ticks / FREQ

    def pwm(self, name):
        """(cycle in s, on-fraction) of a hardware pwm channel."""
        cycle_ns, on_ns = self._pin(name)[7:9]
        return cycle_ns / 1e9, on_ns / cycle_ns if cycle_ns else 0.

    def stepper(self, index):
        """(position, total) in steps of the index-th stepper of the rules."""
        return STEPPER.unpack_from(self.map, STEPPER_AT + STEPPER.size * index)

    def count_edges(self):
        return self._header()[6]

    def list_edges(self, name, start=0):
        """(clock, level) of the edges of one pin since count `start`."""
        end, number = self.count_edges(), find_pin(name)
        if end - start > EDGES:
            raise ValueError("%d edges were not kept" % (end - start - EDGES))
        edges = (EDGE.unpack_from(self.map, EDGE_AT + EDGE.size * (i % EDGES))
                 for i in range(start, end))
        return [(clock, level) for clock, pin, level in edges if pin == number]
