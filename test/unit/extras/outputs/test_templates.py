# SPDX-License-Identifier: GPL-3.0-or-later
"""SET_PIN and SET_FAN_SPEED with a display_template."""
import pytest
from outputs_bench import OutputsBench

CONFIG = """
[display_template half]
param_share: 0.5
text: {param_share * (1 if printer["output_pin lamp"].value else 0.5)}

[display_template bad]
text: off

[output_pin lamp]
pin: PA1

[output_pin dimmer]
pin: PA2
pwm: True
scale: 10
cycle_time: 0.01

[fan_generic vent]
pin: PA3
kick_start_time: 0
"""


def run(tmp_path, monkeypatch, body):
    OutputsBench(tmp_path, monkeypatch, CONFIG).run_ready(body)


def test_values_follow_the_state(tmp_path, monkeypatch):
    def body(it):
        dimmer, vent = it.watch("PA2"), it.watch("PA3")
        it.send("SET_PIN PIN=dimmer TEMPLATE=half PARAM_SHARE=8\n"
                "SET_FAN_SPEED FAN=vent TEMPLATE=half")
        it.pause(1.0)
        assert it.read_duty(dimmer, 1.0) == pytest.approx(0.4, abs=0.01)
        assert it.read_duty(vent, 1.0) == pytest.approx(0.25, abs=0.01)
        it.send("SET_PIN PIN=lamp VALUE=1")
        it.pause(1.5)
        assert it.read_duty(dimmer, 1.0) == pytest.approx(0.8, abs=0.01)
        assert it.get("fan_generic vent")["speed"] == pytest.approx(0.5)
        # a value ends the template
        it.send("SET_PIN PIN=dimmer VALUE=1\nSET_FAN_SPEED FAN=vent SPEED=1")
        it.send("SET_PIN PIN=lamp VALUE=0")
        it.pause(1.5)
        assert it.get("output_pin dimmer") == {"value": 0.1}
        assert it.get("fan_generic vent")["speed"] == 1.0
    run(tmp_path, monkeypatch, body)


def test_digital_pin_switches_at_half(tmp_path, monkeypatch):
    def body(it):
        it.send("SET_PIN PIN=lamp TEMPLATE=half PARAM_SHARE=1")
        it.pause(1.5)
        assert it.get("output_pin lamp") == {"value": 1.0}
        it.send("SET_PIN PIN=lamp TEMPLATE=half PARAM_SHARE=0")
        it.pause(1.5)
        assert it.get("output_pin lamp") == {"value": 0.0}
        it.send("SET_PIN PIN=lamp TEMPLATE=bad")
        it.pause(1.5)
        assert any("it gives 'off', not a number" in line for line in it.output)
    run(tmp_path, monkeypatch, body)


@pytest.mark.parametrize("command", [
    "SET_PIN PIN=lamp", "SET_PIN PIN=lamp VALUE=1 TEMPLATE=half",
    "SET_FAN_SPEED FAN=vent", "SET_FAN_SPEED FAN=vent SPEED=1 TEMPLATE=half"])
def test_value_or_template(tmp_path, monkeypatch, command):
    def body(it):
        with pytest.raises(it.printer.command_error, match="needs either"):
            it.send(command)
    run(tmp_path, monkeypatch, body)
