# SPDX-License-Identifier: GPL-3.0-or-later
"""A tachometer on the simulated machine: pulses of a fan that follows its power."""
import pytest
from outputs_bench import OutputsBench

CONFIG = """
[fan_generic vent]
pin: PA1
tachometer_pin: ^PA2
tachometer_ppr: %d
kick_start_time: 0
"""
FULL_SPEED = 6000.0              # turns a minute


class Rotor:
    """Turns by the fan's duty; the pin changes twice a pulse."""

    def __init__(self, bench, pulses_per_turn):
        self.output = bench.watch("PA1")
        self.mcu = bench.machine.mcus["mcu"]
        self.pin = bench.machine.pins.lookup("PA2").number
        self.edges_per_turn = 2 * pulses_per_turn
        self.turns, self.last_time, self.speed = 0.0, 0.0, 0.0
        bench.world.add_ticker(0.0005, self.tick)

    def tick(self, now):
        elapsed, self.last_time = now - self.last_time, now
        self.turns += self.speed / 60.0 * elapsed
        self.mcu.set_input(self.pin, int(self.turns * self.edges_per_turn) & 1)


@pytest.mark.parametrize("pulses_per_turn", [1, 2])
def test_rpm(tmp_path, monkeypatch, pulses_per_turn):
    bench = OutputsBench(tmp_path, monkeypatch, CONFIG % (pulses_per_turn,))
    rotor = Rotor(bench, pulses_per_turn)

    def body(it):
        it.pause(4.0)
        assert it.get("fan_generic vent")["rpm"] == 0.0
        for speed in (1.0, 0.4):
            it.send("SET_FAN_SPEED FAN=vent SPEED=%s" % (speed,))
            it.pause(1.0)
            rotor.output.read_duty()
            it.pause(0.5)
            rotor.speed = FULL_SPEED * rotor.output.read_duty()
            it.pause(4.0)
            assert it.get("fan_generic vent")["rpm"] == pytest.approx(
                FULL_SPEED * speed, rel=0.02)
        rotor.speed = 0.0            # the fan is stuck
        it.pause(4.0)
        assert it.get("fan_generic vent")["rpm"] == 0.0
        assert it.get("fan_generic vent")["speed"] == 0.4
    bench.run_ready(body)


def test_no_tachometer(tmp_path, monkeypatch):
    def body(it):
        assert it.get("fan_generic vent")["rpm"] is None
    OutputsBench(tmp_path, monkeypatch,
                 "[fan_generic vent]\npin: PA1\n").run_ready(body)
