# SPDX-License-Identifier: GPL-3.0-or-later
"""The turning part of a fan on the simulated machine, with its tachometer."""


class Rotor:
    """Turns at `speed` (turns a minute); the input pin changes twice a pulse."""

    def __init__(self, bench, description, pulses_per_turn):
        pin = bench.machine.pins.lookup(description)
        self.mcu, self.pin = bench.machine.mcus[pin.mcu], pin.number
        self.edges_per_turn = 2 * pulses_per_turn
        self.turns, self.last_time, self.speed = 0.0, 0.0, 0.0
        bench.world.add_ticker(0.0005, self.tick)

    def tick(self, now):
        elapsed, self.last_time = now - self.last_time, now
        self.turns += self.speed / 60.0 * elapsed
        self.mcu.set_input(self.pin, int(self.turns * self.edges_per_turn) & 1)
