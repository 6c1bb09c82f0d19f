# SPDX-License-Identifier: GPL-3.0-or-later
"""Fans, output pins and their request queue on a bench printer."""
import pytest
from bench_printer import Printer

from klippy.errors import CommandError, ConfigError


def make(name, options, **others):
    printer = Printer({name: options, **others})
    loaded = printer.load_object(None, name)
    printer.start()
    return printer, loaded


def test_m106_scales_and_waits_for_the_motion():
    printer, fan = make("fan", {"pin": "PH6", "kick_start_time": 0})
    printer.run("M106", S=127.5)
    assert printer.pins["PH6"].sent == []
    printer.flush(199.9)
    assert printer.pins["PH6"].sent == []
    printer.flush(200.1)
    assert printer.pins["PH6"].sent == [(200.0, 0.5)]
    assert fan.get_status(0.0) == {
        "speed": 0.5, "power": 0.5, "value": 0.5, "rpm": None}
    printer.run("M107")
    printer.flush(300.0)
    assert printer.pins["PH6"].sent[-1][1] == 0.0


def test_kick_start_runs_at_full_power_first():
    printer, fan = make("fan", {"pin": "PH6", "kick_start_time": 0.25})
    printer.run("M106", S=51)
    printer.flush(201.0)
    assert printer.pins["PH6"].sent == [(200.0, 1.0), (200.25, 0.2)]
    assert fan.get_status(0.0)["speed"] == pytest.approx(0.2)


def test_small_changes_are_not_kick_started():
    printer, _ = make("fan", {"pin": "PH6", "kick_start_time": 0.25})
    printer.run("M106", S=102)
    printer.flush(201.0)
    printer.print_time = 210.0
    printer.run("M106", S=153)
    printer.flush(211.0)
    assert printer.pins["PH6"].sent[2:] == [(210.0, 0.6)]


@pytest.mark.parametrize("options,speed,power", [
    ({"max_power": 0.8}, 255, 0.8), ({"off_below": 0.3}, 51, 0.0),
    ({"off_below": 0.3}, 102, 0.4), ({}, 510, 1.0),
    ({"min_power": 0.2, "max_power": 0.6}, 127.5, 0.4), ({"min_power": 0.2}, 0, 0.0)])
def test_power_limits(options, speed, power):
    printer, _ = make("fan", {"pin": "PH6", "kick_start_time": 0, **options})
    printer.run("M106", S=speed)
    printer.flush(201.0)
    expected = [(200.0, pytest.approx(power))] if power else []
    assert printer.pins["PH6"].sent == expected


def test_initial_speed():
    printer, fan = make("fan", {"pin": "PH6", "initial_speed": 0.5, "min_power": 0.2,
                                "enable_pin": "PE1"})
    assert printer.pins["PH6"].setup["setup_start_value"][0] == (
        pytest.approx(0.6), 0.0)
    assert printer.pins["PE1"].setup["setup_start_value"] == ((1, 0), {})
    assert fan.get_status(0.0)["value"] == 0.5
    printer.run("M107")
    printer.flush(201.0)
    assert printer.pins["PH6"].sent == [(200.0, 0.0)]
    assert printer.pins["PE1"].sent == [(200.0, 0)]


def test_min_power_above_max_power():
    with pytest.raises(ConfigError, match="min_power"):
        make("fan", {"pin": "PH6", "min_power": 0.5, "max_power": 0.4})


def test_burst_of_requests_sends_only_the_last_ones():
    printer, _ = make("fan", {"pin": "PH6", "kick_start_time": 0})
    for i in range(50):
        printer.print_time = 200.0 + 0.002 * i
        printer.run("M106", S=100 + i)
    printer.flush(201.0)
    sent = printer.pins["PH6"].sent
    assert len(sent) == 2
    assert sent[1][0] - sent[0][0] >= 0.1 - 1e-9
    assert sent[1][1] == pytest.approx(149 / 255)


def test_enable_pin_follows_the_fan():
    printer, _ = make("fan", {"pin": "PH6", "kick_start_time": 0,
                              "enable_pin": "PE1"})
    for print_time, speed in ((200.0, 255), (210.0, 128), (220.0, 0)):
        printer.print_time = print_time
        printer.run("M106", S=speed)
        printer.flush(print_time + 1.0)
    assert printer.pins["PE1"].sent == [(200.0, 1), (220.0, 0)]


def test_shutdown_speed_reaches_the_pin():
    printer, _ = make("fan", {"pin": "PH6", "shutdown_speed": 1,
                              "max_power": 0.7})
    assert printer.pins["PH6"].setup["setup_start_value"] == ((0.0, 0.7), {})


class OneHeater:
    def __init__(self):
        self.reading = (25.0, 0.0)

    def lookup_heater(self, name):
        assert name == "extruder"
        return self

    def get_temp(self, eventtime):
        return self.reading


def test_heater_fan_runs_while_hot():
    printer = Printer({"heater_fan nozzle": {"pin": "PH4"}})
    heater = printer.objects["heaters"] = OneHeater()
    printer.load_object(None, "heater_fan nozzle")
    printer.start()
    for reading, speed in (((25.0, 0.0), None), ((25.0, 200.0), 1.0),
                           ((120.0, 0.0), 1.0), ((45.0, 0.0), 0.0)):
        heater.reading = reading
        printer.advance(3.0)
        sent = printer.pins["PH4"].sent
        assert (sent[-1][1] if sent else None) == speed
    start = printer.pins["PH4"].setup["setup_start_value"]
    assert start == ((0.0, 1.0), {})


class Enables:
    def __init__(self):
        self.is_on = False

    def get_steppers(self):
        return ["stepper_x", "extruder"]

    def lookup_enable(self, name):
        return self

    def is_motor_enabled(self):
        return self.is_on


def test_controller_fan_idles_before_it_stops():
    printer = Printer({"controller_fan board": {
        "pin": "PB3", "idle_timeout": 10, "idle_speed": 0.4,
        "kick_start_time": 0}})
    printer.objects["heaters"] = OneHeater()
    enables = printer.objects["stepper_enable"] = Enables()
    printer.load_object(None, "controller_fan board")
    printer.start()
    printer.advance(5.0)
    enables.is_on = True
    printer.advance(5.0)
    enables.is_on = False
    printer.advance(30.0)
    times, speeds = zip(*printer.pins["PB3"].sent, strict=True)
    assert speeds == (1.0, 0.4, 0.0)
    assert times[2] - times[1] == pytest.approx(9.0, abs=1.1)


def test_output_pin_pwm_is_scaled():
    printer, pin = make("output_pin beeper", {
        "pin": "PA1", "pwm": "true", "scale": 255, "value": 51})
    assert pin.get_status(0.0) == {"value": pytest.approx(0.2)}
    printer.run("SET_PIN", "beeper", PIN="beeper", VALUE=255)
    printer.flush(201.0)
    assert printer.pins["PA1"].sent == [(200.0, 1.0)]
    with pytest.raises(CommandError):
        printer.run("SET_PIN", "beeper", PIN="beeper", VALUE=256)


def test_digital_output_pin_takes_0_and_1_only():
    printer, pin = make("output_pin led", {"pin": "PA1", "value": 1})
    assert printer.pins["PA1"].setup["setup_start_value"] == ((1.0, 0.0), {})
    printer.run("SET_PIN", "led", PIN="led", VALUE=0)
    printer.flush(201.0)
    assert printer.pins["PA1"].sent == [(200.0, 0.0)]
    with pytest.raises(CommandError, match=r"led.*0 or 1.*0.5"):
        printer.run("SET_PIN", "led", PIN="led", VALUE=0.5)
