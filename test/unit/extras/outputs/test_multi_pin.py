# SPDX-License-Identifier: GPL-3.0-or-later
"""[multi_pin]: one name for several outputs."""
import re
import types

import pytest
from outputs_bench import OutputsBench

from klippy.extras import multi_pin

CONFIG = """
[multi_pin pair]
pins: PB1, !PB2
[output_pin light]
pin: %s
%s
"""


def run(tmp_path, monkeypatch, body, pin="multi_pin:pair", more=""):
    OutputsBench(tmp_path, monkeypatch, CONFIG % (pin, more)).run_ready(body)


@pytest.mark.parametrize("pin,level", [("multi_pin:pair", 1), ("!multi_pin:pair", 0)])
def test_all_follow(tmp_path, monkeypatch, pin, level):
    def body(it):
        traces = [it.watch("PB1"), it.watch("!PB2")]
        assert [t.level for t in traces] == [not level] * 2
        it.send("SET_PIN PIN=light VALUE=1")
        it.pause(0.5)
        assert [t.level for t in traces] == [level] * 2
        it.send("SET_PIN PIN=light VALUE=0")
        it.pause(0.5)
        assert [t.level for t in traces] == [not level] * 2
    run(tmp_path, monkeypatch, body, pin)


def test_pwm(tmp_path, monkeypatch):
    def body(it):
        traces = [it.watch("PB1"), it.watch("!PB2")]
        it.send("SET_PIN PIN=light VALUE=0.3")
        it.pause(0.5)
        for trace in traces:
            assert it.read_duty(trace, 1.0) == pytest.approx(0.3, abs=0.01)
    run(tmp_path, monkeypatch, body, more="pwm: true\ncycle_time: 0.01")


@pytest.mark.parametrize("config,message", [
    (CONFIG % ("multi_pin:other", ""), "no section.*multi_pin other.*only: pair"),
    (CONFIG % ("multi_pin:pair", "[output_pin x]\npin: multi_pin:pair"),
     "used more than once"),
    (CONFIG % ("multi_pin:pair", "[output_pin x]\npin: PB2"), "used more than once"),
    ("[multi_pin none]\npins:\n", "names no pin|pins"),
    ("[multi_pin bad]\npins: ^PB1\n", "pull-up"),
    (CONFIG % ("PB7", "[gcode_button b]\npin: multi_pin:pair\npress_gcode: M117"),
     "multi_pin")])
def test_refused(tmp_path, monkeypatch, config, message):
    def body(it):
        assert it.printer.state == "error"
        assert re.search(message, it.printer.state_message), \
            it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, config).run(body)


def test_only_outputs():
    printer = types.SimpleNamespace(lookup_object=lambda name: None,
                                    config_error=ValueError)
    chip = multi_pin.MultiPinChip(printer)
    chip.add("pair", ["PB1", "PB2"])
    with pytest.raises(ValueError, match="cannot be a endstop"):
        chip.setup_pin("endstop", {"pin": "pair", "invert": 0})


def test_double_inversion():
    assert multi_pin.invert("!PB1") == "PB1"
    assert multi_pin.invert(" mcu2:PB1") == "!mcu2:PB1"
