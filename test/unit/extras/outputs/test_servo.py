# SPDX-License-Identifier: GPL-3.0-or-later
"""Angles and widths of [servo], and the pulses at its pin."""
import pytest
from bench_printer import Printer
from outputs_bench import OutputsBench

from klippy.errors import CommandError, ConfigError


def make(**options):
    printer = Printer({"servo arm": {"pin": "PB1", **options}})
    servo = printer.load_object(None, "servo arm")
    printer.start()
    return printer, servo


def set_servo(printer, **params):
    printer.print_time += 1.0
    printer.run("SET_SERVO", "arm", **params)
    printer.flush(printer.print_time + 0.1)
    return printer.pins["PB1"].sent[-1][1] * 0.020


@pytest.mark.parametrize("params,width", [
    ({"ANGLE": 0}, 0.0010), ({"ANGLE": 180}, 0.0020), ({"ANGLE": 90}, 0.0015),
    ({"ANGLE": 270}, 0.0020), ({"ANGLE": -10}, 0.0010), ({"WIDTH": 0}, 0.0),
    ({"WIDTH": 0.0012}, 0.0012), ({"WIDTH": 0.005}, 0.0020),
    ({"WIDTH": 0.0001}, 0.0010), ({"WIDTH": 0.0018, "ANGLE": 0}, 0.0018)])
def test_pulse_width(params, width):
    printer, servo = make(initial_pulse_width=0.0013)
    assert set_servo(printer, **params) == pytest.approx(width)
    assert servo.get_status(0.0)["value"] == pytest.approx(width / 0.020)


def test_own_range():
    printer, _ = make(minimum_pulse_width=0.0005, maximum_pulse_width=0.0025,
                      maximum_servo_angle=270)
    assert set_servo(printer, ANGLE=135) == pytest.approx(0.0015)
    assert set_servo(printer, ANGLE=27) == pytest.approx(0.0007)


@pytest.mark.parametrize("options,start", [
    ({}, 0.0), ({"initial_angle": 45}, 0.0625), ({"initial_angle": 0}, 0.05),
    ({"initial_pulse_width": 0.002}, 0.1), ({"initial_pulse_width": 0.0002}, 0.05)])
def test_start(options, start):
    printer, servo = make(**options)
    setup = printer.pins["PB1"].setup
    assert setup["setup_start_value"] == ((pytest.approx(start), 0.0), {})
    assert setup["setup_cycle_time"] == ((0.020,), {})
    assert setup["setup_max_duration"] == ((0.0,), {})
    assert servo.get_status(0.0) == {"value": pytest.approx(start)}


def test_same_value_is_sent_once():
    printer, _ = make()
    set_servo(printer, ANGLE=90)
    set_servo(printer, ANGLE=90)
    assert len(printer.pins["PB1"].sent) == 1


def test_needs_an_angle_or_a_width():
    printer, _ = make()
    with pytest.raises(CommandError, match="ANGLE"):
        printer.run("SET_SERVO", "arm")


@pytest.mark.parametrize("options", [
    {"minimum_pulse_width": 0.002, "maximum_pulse_width": 0.001},
    {"initial_angle": 361}, {"initial_pulse_width": 0.003},
    {"maximum_servo_angle": 0}])
def test_bad_options(options):
    with pytest.raises(ConfigError):
        make(**options)


def test_pulses_at_the_pin(tmp_path, monkeypatch):
    def body(it):
        it.pause(0.5)
        trace = it.watch("PB1")
        assert it.read_duty(trace, 1.0) == pytest.approx(0.0625, abs=0.001)
        it.send("SET_SERVO SERVO=arm ANGLE=180")
        it.pause(1.0)
        assert it.read_duty(trace, 1.0) == pytest.approx(0.1, abs=0.001)
        assert it.get("servo arm") == {"value": pytest.approx(0.1)}
        it.send("SET_SERVO SERVO=arm WIDTH=0")
        it.pause(1.0)
        assert it.read_duty(trace, 1.0) == 0.0
    OutputsBench(tmp_path, monkeypatch, """
[servo arm]
pin: PB1
initial_angle: 45
""").run_ready(body)
