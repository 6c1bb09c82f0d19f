# SPDX-License-Identifier: GPL-3.0-or-later
"""What steps, commands and interrupts cost on emulated chips.

A Cortex-M takes one cycle for an instruction here; real ones take more, for
memory that waits and for instructions with more than one access.
"""

import dataclasses
import os

import firmware_matrix
import numpy
import simavr_chip
import unicorn_board
from simavr_board import AvrBoard, find_pin

COUNT = 60000
PROBE_COUNT = 20000
NOPS = 48               # in a block
TRIES = 20

PORT_A = (("PA12", "PA13"), ("PA16", "PA17"), ("PA18", "PA19"))
PORT_B = (("PB0", "PB1"), ("PB3", "PB4"), ("PB6", "PB7"))
PORT_P0 = (("P2.6", "P0.5"), ("P0.6", "P0.7"), ("P0.8", "P0.9"))
GPIO = (("gpio11", "gpio10"), ("gpio6", "gpio7"), ("gpio8", "gpio9"))
SAM = (("PA7", "PA10"), ("PA14", "PA15"), ("PA2", "PA3"))
SAM4E = (("PA7", "PA24"), ("PA14", "PA15"), ("PA2", "PA3"))


@dataclasses.dataclass(frozen=True)
class Line:
    """A chip that stands for others with its processor and its registers."""

    config: str
    core: str
    crystal: int
    pins: tuple
    mhz: int = 0            # where the clock of timers is another one
    field: tuple = ()       # ticks of one and three motors to beat

    @property
    def chip(self):
        return self.config.split("_")[0]


LINES = (
    Line("stm32f072", "M0", 8000000, PORT_B),
    Line("stm32f070", "M0, two timers", 8000000, PORT_B),
    Line("stm32f103", "M3", 8000000, PORT_B, field=(61, 264)),
    Line("stm32f407", "M4", 8000000, PORT_B),
    Line("stm32f446", "M4", 8000000, PORT_B, field=(46, 205)),
    Line("stm32g0b1", "M0+", 8000000, PORT_B),
    Line("stm32g431", "M4", 8000000, PORT_B),
    Line("stm32f765", "M7", 8000000, PORT_B),
    Line("stm32h743", "M7", 8000000, PORT_B),
    Line("lpc1768", "M3", 12000000, PORT_P0, field=(52, 222)),
    Line("sam3x8e", "M3", 12000000, SAM, field=(66, 257)),
    Line("sam4e8e", "M4", 12000000, SAM4E),
    Line("same70q20b", "M7", 12000000, SAM4E, field=(45, 190)),
    Line("samd21g18_serial", "M0+", 32768, PORT_A, field=(70, 306)),
    Line("samc21g18", "M0+, slow clock", 12000000, PORT_A),
    Line("samd51p20_serial", "M4", 25000000, PORT_A),
    Line("rp2040_serial", "M0+", 12000000, GPIO, mhz=120),
    Line("rp2350", "M33, USB", 12000000, GPIO),
)


PORTS_AVR = (("PB0", "PB1"), ("PC0", "PC1"), ("PD4", "PD5"))
AVR_LINES = (
    Line("atmega2560", "AVR", 0, PORTS_AVR, field=(103, 491)),
    Line("atmega328p", "AVR", 0, PORTS_AVR, field=(103, 491)),
)
build_avr_adapter = simavr_chip.build_adapter


class Environment:
    """What tests call monkeypatch: the adapter reads the environment."""

    def setenv(self, name, value):
        os.environ[name] = value


class Bench:
    """One line's chip, powered on again when it has shut down."""

    invert = -1         # steps on both edges
    shortest, longest = 1, 128
    latest_us = 25      # of an edge, behind its clock

    def __init__(self, line, adapter):
        self.line, self.adapter = line, adapter
        self.out = firmware_matrix.build(line.config)
        self.board = None
        self.restart()

    def power_on(self):
        """A board that was identified, and a function that numbers its pins."""
        line = self.line
        unicorn_board.choose_chip(Environment(), self.out, line.chip, line.crystal)
        board = unicorn_board.UnicornBoard(self.adapter)
        board.identify()
        return board, board.find_pin

    def restart(self):
        if self.board:
            self.board.ops.power_off()
        self.board, number = self.power_on()
        self.pins = [number(step) for step, _ in self.line.pins]
        self.board.configure(*[
            ("config_stepper", dict(oid=i, step_pin=number(step),
                                    dir_pin=number(direction),
                                    invert_step=self.invert, step_pulse_ticks=0))
            for i, (step, direction) in enumerate(self.line.pins)])

    @property
    def mhz(self):
        """Of the processor."""
        return self.line.mhz or self.board.freq / 1e6

    def start(self, n_motors, interval, count):
        """Queue such runs; returns the clock from which they count."""
        board = self.board
        origin = board.clock + board.freq // 20
        for name, more in (("reset_step_clock", dict(clock=origin % 2**32)),
                           ("queue_step", dict(interval=interval, count=count,
                                               add=0))):
            for oid in range(n_motors):
                board.send(name, oid=oid, **more)
        return origin

    def measure_step(self):
        """Instructions of an interrupt that makes one step: least, mean."""
        board = self.board
        self.start(1, board.freq // 2000, 400)
        board.run_for(0.08)
        _, irqs, total = board.read_stats()
        board.read_delays()
        board.run_for(0.1)
        _, irqs_after, total_after = board.read_stats()
        least = board.read_delays()[2]
        board.run_for(0.1)
        return least, (total_after - total) / (irqs_after - irqs)

    def survives(self, n_motors, interval, count=COUNT):
        """True if so many motors make all their steps, each on time."""
        board = self.board
        board.edges.clear()
        origin = self.start(n_motors, interval, count)
        board.run_for(0.1 + count * interval / board.freq)
        clocks = origin + interval * numpy.arange(1, count + 1)
        edges = numpy.array(board.edges, dtype=numpy.int64).reshape(-1, 3)
        if self.invert >= 0:
            edges = edges[edges[:, 2] == 1]
        latest = self.latest_us * board.freq / 1e6
        if board.find_shutdown():
            self.restart()
            return False
        got = [edges[edges[:, 1] == pin, 0] for pin in self.pins[:n_motors]]
        return all(len(e) == count and (e - clocks).max() <= latest for e in got)

    def find_shortest(self, n_motors):
        """Shortest interval that survives, in ticks."""
        low, high = self.shortest, self.longest * n_motors
        while high - low > 1:
            middle = (low + high) // 2
            if self.survives(n_motors, middle, PROBE_COUNT):
                high = middle
            else:
                low = middle
        while not self.survives(n_motors, high):
            high += 1 + high // 50
        return high

    def measure_nop(self):
        """Cycles of a debug_nop with its share of everything: interrupts
        for its bytes, the block's check, the acknowledgement."""
        board = self.board
        nop = board.commands["debug_nop"].encode({})
        before, idle = board.read_stats()[0], board.clock
        for _ in range(TRIES):
            board.send_block(nop * (NOPS // len(nop)))
        spent = board.clock - idle
        work = board.read_stats()[0] - before
        board.run(board.clock + spent)
        rest = board.read_stats()[0] - before - work
        return (work - rest) / (TRIES * (NOPS // len(nop)))

    def measure_delays(self):
        """Longest that interrupts wait, in cycles, while three motors step, runs
        are queued and commands are answered: with interrupts off; for another."""
        board = self.board
        board.read_delays()
        interval = board.freq // 10000
        begin = self.start(3, interval, 20000)
        for _ in range(TRIES):
            for oid in range(3):
                board.send("queue_step", oid=oid, interval=interval, count=1, add=0)
            board.query("get_clock", "clock")
            board.query("get_uptime", "uptime")
        board.run(max(board.clock, begin) + 3 * board.freq)
        assert board.find_shutdown() is None
        return board.read_delays()[:2]


class AvrBench(Bench):
    """The same in simavr, with pulses: what the field's figures are for."""

    invert = 0
    shortest, longest = 32, 256
    latest_us = 1000    # more is a shutdown

    def power_on(self):
        simavr_chip.choose_chip(Environment(), self.out / "klipper.elf",
                                self.line.config)
        board = AvrBoard(self.adapter)
        return board, lambda name: find_pin(board, name)

    def measure_delays(self):
        """On a chip of its own: one that is watched is slow."""
        delays = super().measure_delays()
        self.restart()
        return delays
