# SPDX-License-Identifier: GPL-3.0-or-later
"""Reports of button pins, analog keys, encoders; [gcode_button] on a machine."""
import pytest
from bench_printer import Printer
from outputs_bench import OutputsBench

from klippy.errors import CommandError
from klippy.extras import buttons


class Acks:
    def __init__(self):
        self.counts = []

    def send(self, data):
        self.counts.append(data[1])


class ButtonsMcu:
    def register_config_callback(self, callback):
        pass


def make_group():
    group = buttons.McuButtons(Printer(), ButtonsMcu())
    group.ack_cmd, calls = Acks(), []
    for name, pins in (("a", [{}]), ("b", [{}, {}])):
        group.add(pins, lambda time, state, name=name: calls.append((name, state)))
    return group, calls


def test_reports_go_to_whom_they_concern():
    group, calls = make_group()
    for ack_count, state in ((0, b"\x01"), (1, b"\x05\x07\x06"), (4, b"\x00")):
        group._handle_state({"ack_count": ack_count, "state": state})
    assert calls == [("a", 1), ("b", 2), ("b", 3), ("a", 0), ("b", 0)]
    assert group.ack_cmd.counts == [1, 3, 1]


def test_what_comes_again_counts_once():
    group, calls = make_group()
    for ack_count, state in ((0, b"\x01"), (0, b"\x01"), (0, b"\x01\x00"),
                             (1, b"\x00"), (2, b"\x01")):
        group._handle_state({"ack_count": ack_count, "state": state})
    assert calls == [("a", 1), ("a", 0), ("a", 1)]
    assert group.ack_cmd.counts == [1, 1, 1]


def test_the_count_has_8_bits():
    group, calls = make_group()
    for count in range(600):
        group._handle_state({"ack_count": count & 0xff,
                             "state": bytes([~count & 1])})
    assert len(calls) == 600


def turn(encoder, levels, start=1.0, gap=0.01):
    for index, bits in enumerate(levels):
        encoder.note_levels(start + gap * index, bits)


@pytest.mark.parametrize("steps,levels,turns", [
    (4, (1, 3, 2, 0), "+"), (4, (2, 3, 1, 0), "-"), (4, (1, 3, 2, 0) * 3, "+++"),
    (2, (1, 3, 2, 0), "++"), (2, (2, 3), "-"), (4, (1, 0, 1, 0), ""),
    (4, (1, 3, 1, 3, 2, 3, 2, 0), "+"), (4, (3, 1, 0), "")])
def test_encoder(steps, levels, turns):
    seen = []
    encoder = buttons.RotaryEncoder(steps, lambda t: seen.append("+"),
                                    lambda t: seen.append("-"))
    turn(encoder, levels)
    assert "".join(seen) == turns


def test_encoder_finds_its_detents_again():
    seen = []
    encoder = buttons.RotaryEncoder(4, lambda t: seen.append("+"),
                                    lambda t: seen.append("-"))
    turn(encoder, (3, 2, 0))
    turn(encoder, (1, 3, 2, 0), start=2.0)
    turn(encoder, (2, 3, 1, 0), start=3.0)
    assert seen == ["+", "-"]


def report(pin, start, fraction, count=4):
    for index in range(count):
        pin.report(start + 0.015 * index, fraction)


def test_keys_of_an_analog_pin():
    printer, calls = Printer(), []
    group = buttons.PrinterButtons(printer.make_section("buttons"))
    for name, low, high in (("a", 0, 100), ("b", 900, 1100)):
        group.register_adc_button(
            "PK1", low, high, 1000.0,
            lambda time, state, name=name: calls.append((name, state)))
    pin = printer.pins["PK1"]
    report(pin, 1.0, 1.0)
    report(pin, 2.0, 0.5)
    assert calls == [("b", True)]
    report(pin, 3.0, 0.01, count=1)
    report(pin, 3.015, 0.5)
    assert calls == [("b", True)]
    report(pin, 4.0, 0.01)
    report(pin, 5.0, 0.8)
    assert calls == [("b", True), ("b", False), ("a", True), ("a", False)]
    with pytest.raises(printer.config_error, match="one pull-up"):
        group.register_adc_button("PK1", 0, 1, 4700.0, None)


def test_debouncer():
    printer, calls = Printer(), []
    debouncer = buttons.Debouncer(
        printer, 0.2, lambda time, state: calls.append((round(time, 3), state)))
    for state in (1, 0, 1):
        debouncer.note_state(printer.now, state)
        printer.advance(0.1)
    assert calls == []
    printer.advance(0.2)
    debouncer.note_state(printer.now, 0)
    printer.advance(0.1)
    debouncer.note_state(printer.now, 1)
    printer.advance(1.0)
    assert calls == [(100.4, True)]


CONFIG = """
[output_pin light]
pin: PB7
[gcode_button stop]
pin: ^!PC1
press_gcode:
    SET_PIN PIN=light VALUE={1 - printer["output_pin light"].value}
release_gcode: {action_respond_info("let go")}
[gcode_button slow]
pin: PC2
debounce_delay: 0.5
press_gcode: M118 slow
[gcode_button key]
pin: PK1
analog_range: 900, 1100
analog_pullup_resistor: 1000
press_gcode: {action_raise_error("no such thing")}
release_gcode: NOT_A_COMMAND
"""


@pytest.fixture
def bench(tmp_path, monkeypatch):
    it = OutputsBench(tmp_path, monkeypatch, CONFIG)
    it.press("!PC1", False)
    set_key(it, 1.0)
    return it


def set_key(it, fraction):
    pin = it.machine.pins.lookup("PK1")
    it.machine.mcus[pin.mcu].set_adc(pin.number, fraction)


def run(bench, body):
    """Run body once the mcu looks at its buttons."""
    def check(it):
        it.pause(2.0)
        body(it)
    bench.run_ready(check)


def test_press_and_release(bench):
    trace = bench.watch("PB7")

    def body(it):
        for level in (1, 0):
            it.press("!PC1", True)
            it.pause(0.6)
            assert it.get("gcode_button stop") == {"state": "PRESSED"}
            assert trace.level == level
            it.send("QUERY_BUTTON BUTTON=stop")
            assert it.output.pop() == "// stop: PRESSED"
            it.press("!PC1", False)
            it.pause(0.6)
            assert it.get("gcode_button stop") == {"state": "RELEASED"}
            assert it.output.pop() == "// let go"
    run(bench, body)


def test_debounce_delay(bench):
    def body(it):
        for seconds, state in ((0.3, "RELEASED"), (0.7, "PRESSED")):
            it.press("PC2", True)
            it.pause(seconds)
            assert it.get("gcode_button slow") == {"state": state}
            it.press("PC2", False)
            it.pause(0.3)
            assert it.get("gcode_button slow") == {"state": state}
        it.pause(0.4)
        assert it.get("gcode_button slow") == {"state": "RELEASED"}
    run(bench, body)


def test_analog_key_and_a_script_that_fails(bench):
    def body(it):
        set_key(it, 0.5)
        it.pause(0.5)
        assert it.get("gcode_button key") == {"state": "PRESSED"}
        assert any("Button key: no such thing" in line for line in it.output)
        set_key(it, 0.9)
        it.pause(0.5)
        assert it.get("gcode_button key") == {"state": "RELEASED"}
        assert any("NOT_A_COMMAND" in line for line in it.output)
        with pytest.raises(CommandError):
            it.send("QUERY_BUTTON BUTTON=none")
    run(bench, body)


def test_nothing_is_lost_on_a_bad_link(bench):
    def body(it):
        it.machine.mcus["mcu"].link.set_faults(drop=0.002, flip=0.002)
        calls = []
        button = it.printer.lookup_object("gcode_button stop")
        note = button._note_state
        group = it.printer.lookup_object("buttons").groups[0]
        group.watchers[0] = (*group.watchers[0][:2], lambda t, s: (
            calls.append(s), note(t, s)))
        for _ in range(10):
            for is_pressed in (True, False):
                it.press("!PC1", is_pressed)
                it.pause(0.05)
        it.pause(1.0)
        assert calls == [1, 0] * 10
    run(bench, body)


@pytest.mark.parametrize("wrong,message", [
    ("pin: PC3\nanalog_range: 5, 1\npress_gcode: M117", "analog_range"),
    ("pin: PC3\npress_gcode: {1 +}", "press_gcode"), ("pin: PC3", "press_gcode"),
    ("pin: PC1\npress_gcode: M117", "more than once")])
def test_bad_options(tmp_path, monkeypatch, wrong, message):
    def body(it):
        assert it.printer.state == "error" and message in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch,
                 CONFIG + "[gcode_button bad]\n" + wrong + "\n").run(body)
