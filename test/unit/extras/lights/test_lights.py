# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights on the simulated machine: what the leds at the pins show."""
import random

import pytest
from outputs_bench import OutputsBench

from klippy.extras import led, neopixel, pca9533
from klippy.simulator import lights

NEOPIXEL = """
[neopixel strip]
pin: PA1
chain_count: %d
color_order: %s
%s
"""


class LightsBench(OutputsBench):
    def add_neopixel(self, n_bytes, name="PA1"):
        pin = self.machine.pins.lookup(name)
        return lights.NeopixelStrip(self.machine.mcus[pin.mcu], pin.number, n_bytes)

    def show(self, script):
        self.send(script)
        self.pause(1.0)

    def set_colors(self, colors):
        """Send a list of (r, g, b) in 0..255, shown with the last one."""
        for index, (r, g, b) in enumerate(colors):
            self.send("SET_LED LED=strip RED=%.4f GREEN=%.4f BLUE=%.4f INDEX=%d"
                      " TRANSMIT=%d" % (r / 255, g / 255, b / 255, index + 1,
                                        index == len(colors) - 1))
        self.pause(1.0)


def run(tmp_path, monkeypatch, config, body):
    LightsBench(tmp_path, monkeypatch, config).run_ready(body)


def test_neopixel_shows_what_is_set(tmp_path, monkeypatch):
    def body(it):
        strip = it.add_neopixel(9)
        it.show("SET_LED LED=strip RED=1 GREEN=0.5")
        assert strip.read() == bytes([128, 255, 0] * 3)
        it.show("SET_LED LED=strip BLUE=0.2 INDEX=2")
        assert strip.read() == bytes([128, 255, 0, 0, 0, 51, 128, 255, 0])
        it.show("SET_LED LED=strip RED=0.2 INDEX=1 TRANSMIT=0")
        assert strip.read()[:3] == bytes([128, 255, 0])
        it.show("SET_LED LED=strip INDEX=3 SYNC=0")
        assert strip.read() == bytes([0, 51, 0, 0, 0, 51, 0, 0, 0])
        assert it.get("neopixel strip") == {"color_data": [
            [0.2, 0.0, 0.0, 0.0], [0.0, 0.0, 0.2, 0.0], [0.0] * 4]}
        assert strip.n_updates == 3
        for bad in ("RED=1.1", "INDEX=4", "INDEX=0", "RED=x"):
            with pytest.raises(it.printer.command_error):
                it.send("SET_LED LED=strip " + bad)
    run(tmp_path, monkeypatch, NEOPIXEL % (3, "GRB", ""), body)


def test_neopixel_starts_with_its_initial_color(tmp_path, monkeypatch):
    bench = LightsBench(tmp_path, monkeypatch, NEOPIXEL % (
        2, "RGB", "initial_red: 0.2\ninitial_blue: 1"))
    strip = bench.add_neopixel(6)

    def body(it):
        it.pause(0.5)
        assert strip.read() == bytes([51, 0, 255] * 2)
    bench.run_ready(body)


def test_neopixel_mixed_orders(tmp_path, monkeypatch):
    def body(it):
        strip = it.add_neopixel(3 + 4 + 4)
        it.show("SET_LED LED=strip RED=0.2 GREEN=0.4 BLUE=0.6 WHITE=1")
        assert strip.read() == bytes([102, 51, 153, 255, 51, 102, 153,
                                      102, 51, 153, 255])
    run(tmp_path, monkeypatch, NEOPIXEL % (3, "GRB, wrgb, GRBW", ""), body)


def test_long_chain_is_sent_in_pieces(tmp_path, monkeypatch):
    def body(it):
        strip = it.add_neopixel(498)
        rng = random.Random(5)
        colors = [tuple(rng.randrange(256) for _ in range(3)) for _ in range(166)]
        it.set_colors(colors)
        assert strip.read() == bytes(sum(colors, ()))
        sent = it.machine.mcus["mcu"].link.bytes_to_mcu
        it.show("SET_LED LED=strip INDEX=166")
        assert strip.read() == bytes(sum(colors[:-1], ())) + bytes(3)
        # only what has changed goes over the link, besides what always does
        assert it.machine.mcus["mcu"].link.bytes_to_mcu - sent < 200
    run(tmp_path, monkeypatch, NEOPIXEL % (166, "RGB", ""), body)


def test_changes_of_data():
    rng = random.Random(7)
    for _ in range(200):
        old = bytes(rng.choice((0, 1)) for _ in range(60))
        new = bytearray(old)
        for _ in range(rng.randrange(6)):
            new[rng.randrange(60)] ^= 1
        spans = neopixel.list_changes(old, bytes(new))
        shown = bytearray(old)
        for start, end in spans:
            shown[start:end] = new[start:end]
        assert shown == new
        assert all(a[1] + neopixel.MERGE_GAP < b[0]
                   for a, b in zip(spans, spans[1:], strict=False))
    assert neopixel.list_changes(None, bytes(9)) == [(0, 9)]


@pytest.mark.parametrize("count,order,message", [
    (3, "GRB, RGB", "it needs one, or one for each of the 3 leds"),
    (1, "GRX", "should hold R, G and B"), (1, "GRBWW", "should hold R, G and B"),
    (167, "RGB", "takes 501 bytes, at most 500"), (0, "RGB", "chain_count")])
def test_bad_neopixel(tmp_path, monkeypatch, count, order, message):
    def body(it):
        assert message in it.printer.state_message
    LightsBench(tmp_path, monkeypatch, NEOPIXEL % (count, order, "")).run(body)


def test_light_changes_where_the_move_does(tmp_path, monkeypatch):
    """SET_LED after a move shows when the move has ended, not before."""
    def body(it):
        strip = it.add_neopixel(3)
        toolhead = it.printer.lookup_object("toolhead")
        mcu = it.printer.lookup_object("mcu")
        now = mcu.estimated_print_time(it.printer.get_reactor().monotonic())
        monkeypatch.setattr(toolhead, "get_last_move_time", lambda: now + 2.0)
        it.send("SET_LED LED=strip RED=1")
        it.pause(1.99)
        assert strip.read() == bytes(3)
        it.pause(0.03)
        assert strip.read() == bytes([255, 0, 0])
    run(tmp_path, monkeypatch, NEOPIXEL % (1, "RGB", ""), body)


TEMPLATES = """
[display_template heat]
param_low: 20
param_gain: 0.01
text:
  {% set t = printer["temperature_sensor room"].temperature %}
  {(t - param_low) * param_gain}, 0.25

[display_template broken]
text: {1 / 0}

[display_template words]
text: blue

[temperature_sensor room]
sensor_type: Generic 3950
sensor_pin: PK5
"""


def test_templates(tmp_path, monkeypatch):
    def body(it):
        strip = it.add_neopixel(6)
        it.pause(2.0)
        room = it.get("temperature_sensor room")["temperature"]
        assert room == pytest.approx(25.0, abs=0.2)
        it.show("SET_LED LED=strip BLUE=1")
        it.show("SET_LED_TEMPLATE LED=strip TEMPLATE=heat PARAM_GAIN=0.1 INDEX=2")
        assert strip.read()[:3] == bytes([0, 0, 255])
        red, green, blue = strip.read()[3:]
        assert red == pytest.approx(255 * (room - 20) * 0.1, abs=2)
        assert (green, blue) == (64, 0)
        # the template wins over a color until it is taken away
        it.show("SET_LED_TEMPLATE LED=strip TEMPLATE= INDEX=2\n"
                "SET_LED LED=strip GREEN=1")
        it.pause(2.0)
        assert strip.read() == bytes([0, 255, 0] * 2)
        it.show("SET_LED_TEMPLATE LED=strip TEMPLATE=heat")
        assert strip.read()[:3] == strip.read()[3:] != bytes(3)
    run(tmp_path, monkeypatch, NEOPIXEL % (2, "RGB", "") + TEMPLATES, body)


@pytest.mark.parametrize("name,message", [
    ("broken", "'broken' is not used any more: Error evaluating"),
    ("words", "'words' is not used any more: it gives 'blue'")])
def test_bad_templates_end(tmp_path, monkeypatch, name, message):
    def body(it):
        it.show("SET_LED_TEMPLATE LED=strip TEMPLATE=" + name)
        it.pause(2.0)
        told = [line for line in it.output if message in line]
        assert len(told) == 1 and told[0].startswith("!! ")
    run(tmp_path, monkeypatch, NEOPIXEL % (2, "RGB", "") + TEMPLATES, body)


@pytest.mark.parametrize("params,message", [
    ("TEMPLATE=heart", "There is no .display_template heart.: known are broken, heat"),
    ("TEMPLATE=heat PARAM_X=1", "has no param_x: known are param_gain, param_low"),
    ("TEMPLATE=heat PARAM_LOW=x", "param_low=x"), ("INDEX=1", "TEMPLATE")])
def test_bad_template_commands(tmp_path, monkeypatch, params, message):
    def body(it):
        with pytest.raises(it.printer.command_error, match=message):
            it.send("SET_LED_TEMPLATE LED=strip " + params)
    run(tmp_path, monkeypatch, NEOPIXEL % (2, "RGB", "") + TEMPLATES, body)


@pytest.mark.parametrize("text,color", [
    ("1", (1, 0, 0, 0)), (" 0.5,,0.25, 2", (0.5, 0, 0.25, 1)), ("-1,0,0", (0,) * 4)])
def test_read_color(text, color):
    assert led.read_color(text) == color


@pytest.mark.parametrize("text", ["nan", "1,2,3,4,5", "red"])
def test_read_bad_color(text):
    with pytest.raises(ValueError):
        led.read_color(text)


def test_dotstar(tmp_path, monkeypatch):
    config = """
[dotstar bar]
data_pin: PA1
clock_pin: PA2
chain_count: 30
initial_green: 1
"""
    bench = LightsBench(tmp_path, monkeypatch, config)
    pins = [bench.machine.pins.lookup(name).number for name in ("PA1", "PA2")]
    strip = lights.DotstarStrip(bench.machine.mcus["mcu"], *pins, 30)

    def body(it):
        it.pause(1.0)
        assert strip.read() == [(31, 0, 255, 0)] * 30
        it.show("SET_LED LED=bar RED=0.2 BLUE=1 INDEX=30")
        assert strip.read() == [(31, 0, 255, 0)] * 29 + [(31, 51, 0, 255)]
        it.show("SET_LED LED=bar")
        assert strip.read() == [(31, 0, 0, 0)] * 30
    bench.run_ready(body)


def test_dotstar_needs_pins_of_one_mcu(tmp_path, monkeypatch):
    def body(it):
        assert "must be of one mcu" in it.printer.state_message
    LightsBench(tmp_path, monkeypatch, """
[mcu tool]
serial: /dev/none
[dotstar bar]
data_pin: PA1
clock_pin: tool:PA2
""").run(body)


LED_PINS = """
[led lamp]
red_pin: PA1
white_pin: !PA4
initial_white: 0.25
hardware_pwm: %s
"""


@pytest.mark.parametrize("hard", ["True", "False"])
def test_led_pins(tmp_path, monkeypatch, hard):
    bench = LightsBench(tmp_path, monkeypatch, LED_PINS % (hard,))
    red, white = bench.watch("PA1"), bench.watch("!PA4")

    def body(it):
        it.pause(1.0)
        assert it.read_duty(white, 1.0) == pytest.approx(0.25, abs=0.01)
        it.show("SET_LED LED=lamp RED=0.75 WHITE=1")
        assert it.read_duty(red, 1.0) == pytest.approx(0.75, abs=0.01)
        assert it.read_duty(white, 1.0) == pytest.approx(1.0, abs=0.001)
        it.show("SET_LED LED=lamp RED=0.5 SYNC=0")
        assert it.read_duty(red, 1.0) == pytest.approx(0.5, abs=0.01)
        assert it.read_duty(white, 1.0) == 0.0
        assert it.get("led lamp") == {"color_data": [[0.5, 0.0, 0.0, 0.0]]}
    bench.run_ready(body)


def test_led_without_pins(tmp_path, monkeypatch):
    def body(it):
        assert "needs a pin: red_pin" in it.printer.state_message
    LightsBench(tmp_path, monkeypatch, "[led lamp]\ninitial_red: 1\n").run(body)


class RegisterChip:
    """An I2C chip that keeps what is written to its registers."""

    def __init__(self):
        self.registers = {}

    def exchange(self, written, read_len):
        for offset, value in enumerate(written[1:]):
            self.registers[written[0] + offset] = value
        return bytes(read_len)

    def read_pca9533(self):
        """On-share of each output: its two dimmers are registers 2 and 4."""
        select = self.registers[5]
        shares = [0.0, 1.0, self.registers.get(2, 0) / 256,
                  self.registers.get(4, 0) / 256]
        return [shares[select >> (2 * i) & 3] for i in range(4)]

    def read_pca9632(self):
        """On-share of each output; nothing shines while it sleeps."""
        assert self.registers[0] & 0x10 == 0
        select = self.registers[8]
        return [{0: 0.0, 1: 1.0, 2: self.registers[2 + i] / 256}[select >> (2 * i) & 3]
                for i in range(4)]


def run_chip(tmp_path, monkeypatch, config, body, address=0x62):
    bench = LightsBench(tmp_path, monkeypatch, config)
    chip = RegisterChip()
    bench.machine.mcus["mcu"].add_i2c_device(0, address, chip.exchange)
    bench.run_ready(lambda it: body(it, chip))


def test_pca9533(tmp_path, monkeypatch):
    def body(it, chip):
        it.pause(0.5)
        assert chip.read_pca9533() == [0, 0, 1, 0]
        it.show("SET_LED LED=x RED=0.5 GREEN=0.25 BLUE=0 WHITE=1")
        assert chip.read_pca9533() == [0.5, 0.25, 0, 1]
        assert it.get("pca9533 x") == {"color_data": [[0.5, 0.25, 0, 1]]}
    run_chip(tmp_path, monkeypatch, "[pca9533 x]\ninitial_blue: 1\n", body)


def test_pca9533_levels():
    assert pca9533.choose_levels([]) == []
    assert pca9533.choose_levels([7, 7]) == [7]
    assert pca9533.choose_levels([90, 10, 80]) == [10, 90]


def test_pca9632(tmp_path, monkeypatch):
    def body(it, chip):
        it.pause(0.5)
        assert chip.read_pca9632() == [0, 0, 0, 0]
        it.show("SET_LED LED=x RED=0.2 GREEN=0.4 BLUE=1")
        assert chip.read_pca9632() == pytest.approx(
            [0.4, 0.2, 1, 0], abs=0.005)
        assert chip.registers[1] == 0x14
    run_chip(tmp_path, monkeypatch, """
[pca9632 x]
color_order: GRBW
i2c_address: 99
i2c_bus: i2c0
""", body, address=99)


def test_i2c_chip_that_is_not_there(tmp_path, monkeypatch, caplog):
    def body(it):
        it.show("SET_LED LED=x RED=0.2")
        told = [r for r in caplog.records if "I2C device 0x62" in r.getMessage()]
        assert len(told) == 1 and "does not" in told[0].getMessage()
    run(tmp_path, monkeypatch, "[pca9533 x]\n", body)


def test_i2c_unknown_bus(tmp_path, monkeypatch):
    def body(it):
        assert "Unknown i2c_bus 'i2c9' of mcu 'mcu': it has i2c" in (
            it.printer.state_message)
    LightsBench(tmp_path, monkeypatch, "[pca9533 x]\ni2c_bus: i2c9\n").run(body)
