# SPDX-License-Identifier: GPL-3.0-or-later
"""A tachometer on the simulated machine: pulses of a fan that follows its power."""
import pytest
from fan_rotor import Rotor
from outputs_bench import OutputsBench

CONFIG = """
[fan_generic vent]
pin: PA1
tachometer_pin: ^PA2
tachometer_ppr: %d
kick_start_time: 0
"""
FULL_SPEED = 6000.0              # turns a minute


@pytest.mark.parametrize("pulses_per_turn", [1, 2])
def test_rpm(tmp_path, monkeypatch, pulses_per_turn):
    bench = OutputsBench(tmp_path, monkeypatch, CONFIG % (pulses_per_turn,))
    output = bench.watch("PA1")
    rotor = Rotor(bench, "PA2", pulses_per_turn)

    def body(it):
        it.pause(4.0)
        assert it.get("fan_generic vent")["rpm"] == 0.0
        for speed in (1.0, 0.4):
            it.send("SET_FAN_SPEED FAN=vent SPEED=%s" % (speed,))
            it.pause(1.0)
            output.read_duty()
            it.pause(0.5)
            rotor.speed = FULL_SPEED * output.read_duty()
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
