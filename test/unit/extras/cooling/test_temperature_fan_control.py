# SPDX-License-Identifier: GPL-3.0-or-later
"""Controls of [temperature_fan], each on its own."""
import types

import bench_machine
import pytest
from bench_printer import Printer
from daemon_run import ApiError, Host
from machine_configs import make_axes

from klippy.errors import ConfigError
from klippy.extras import temperature_fan_control as controls


def make(kind, **options):
    owner = types.SimpleNamespace(max_speed=1.0, min_speed=0.0, target_temp=70.0)
    section = Printer({"temperature_fan f": options}).make_section("temperature_fan f")

    def getlists(option, seps, parser, count):
        return [tuple(parser(word) for word in line.split(seps[0]))
                for line in section.get(option).split(seps[1])]

    section.getlists = getlists
    return controls.KINDS[kind](owner, section)


CURVE = "50, 0.2\n30, 0"       # and 1.0 at the target, 70


@pytest.mark.parametrize("temp,speed", [
    (20, 0.0), (30, 0.0), (40, 0.1), (50, 0.2), (60, 0.6), (70, 1.0), (90, 1.0)])
def test_curve(temp, speed):
    control = make("curve", points=CURVE, smooth_readings=0)
    assert control.calc_speed(0.0, temp, 70.0) == pytest.approx(speed)


@pytest.mark.parametrize("target,temp,speed", [
    (60, 60, 1.0), (60, 55, 0.6), (40, 35, 0.5), (40, 45, 1.0), (25, 24, 0.0),
    (25, 25, 1.0)])
def test_curve_ends_at_another_target(target, temp, speed):
    control = make("curve", points=CURVE, smooth_readings=0)
    assert control.calc_speed(0.0, temp, target) == pytest.approx(speed)


def test_curve_takes_the_median():
    control = make("curve", points=CURVE, smooth_readings=3)
    speeds = [control.calc_speed(i, temp, 70.0)
              for i, temp in enumerate([50, 50, 70, 50, 60, 60])]
    assert speeds == pytest.approx([0.2, 0.2, 0.2, 0.2, 0.6, 0.6])


def test_curve_hysteresis():
    control = make("curve", points=CURVE, smooth_readings=1, cooling_hysteresis=5,
                   heating_hysteresis=2)
    temps = [60, 61, 62, 64, 62, 58, 56]
    held = [60, 60, 60, 62, 62, 62, 61]
    for temp, expected in zip(temps, held, strict=True):
        assert control.calc_speed(0.0, temp, 70.0) == pytest.approx(
            0.2 + 0.04 * (expected - 50))


@pytest.mark.parametrize("points", [
    "50, 0.5\n60, 0.4", "50, 0.5\n50, 0.6", "40, 0\n50, 1.1", "70, 0.5", "20, -0.1"])
def test_bad_curves(points):
    with pytest.raises(ConfigError, match="points"):
        make("curve", points=points)


def test_watermark_reverse():
    control = make("watermark", max_delta=2, reverse="true")
    assert [control.calc_speed(0.0, temp, 40.0) for temp in (37, 39, 41, 43, 41)] == [
        1.0, 1.0, 1.0, 0.0, 0.0]


@pytest.mark.parametrize("reverse,temp", [("false", 45.0), ("true", 35.0)])
def test_pid_acts_in_its_direction(reverse, temp):
    control = make("pid", pid_kp=20, pid_ki=0, pid_kd=0, reverse=reverse)
    assert control.calc_speed(1.0, temp, 40.0) == pytest.approx(100 / 255)
    assert control.calc_speed(2.0, 80.0 - temp, 40.0) == 0.0


def test_pid_integral_max():
    control = make("pid", pid_kp=0, pid_ki=255, pid_kd=0, pid_integral_max=0.25)
    for second in range(100):
        speed = control.calc_speed(float(second), 50.0, 40.0)
    assert speed == pytest.approx(0.25)


CURVE_FAN = """
[temperature_fan electronics]
pin: PH4
sensor_type: PT1000
sensor_pin: PK1
min_temp: 0
max_temp: 90
control: curve
min_speed: 0
target_temp: 70
kick_start_time: 0
points:
  40, 0
  50, 0.3
"""


def test_curve_on_the_machine(tmp_path, monkeypatch):
    def body(it):
        mcu = it.machine.mcus["mcu"]
        pin = it.machine.pins.lookup("PK1").number
        fan = mcu.watch_output(it.machine.pins.lookup("PH4").number)
        it.machine.thermal.inputs.clear()
        for temp, speed in ((30, 0.0), (60, 0.65), (80, 1.0)):
            ohm = 1000 * (1 + 3.9083e-3 * temp - 5.775e-7 * temp * temp)
            mcu.set_adc(pin, ohm / (ohm + 4700))
            it.pause(10.0)
            fan.read_duty()
            it.pause(1.0)
            assert fan.read_duty() == pytest.approx(speed, abs=0.04)
        assert it.get("temperature_fan electronics")["control"] == "curve"
    bench_machine.Bench(tmp_path, monkeypatch, """
[mcu]
serial: /dev/none
[printer]
kinematics: none
max_velocity: 100
max_accel: 1000
""" + CURVE_FAN).run(body)


def read_speed(host):
    host.pause(15.0)
    return host.status("temperature_fan electronics")["speed"]


def test_curve_changed_while_it_works(tmp_path):
    """The speeds are those of the new line at the temperature of the sensor."""
    host = Host(tmp_path, make_axes("cartesian") + CURVE_FAN.replace(
        "PH4", "PF6").replace("PK1", "PF7"))
    command = "SET_TEMPERATURE_FAN_CURVE TEMPERATURE_FAN=electronics "

    def change(host):
        mcu = host.machine.mcus["mcu"]
        host.machine.thermal.inputs.clear()
        mcu.set_adc(host.machine.pins.lookup("PF7").number, 1230.9 / (1230.9 + 4700))
        assert read_speed(host) == pytest.approx(0.65, abs=0.02)        # at 60 degC
        host.script(command + "POINTS='40:0.5, 50:0.6'")
        assert read_speed(host) == pytest.approx(0.8, abs=0.02)
        host.script(command + "TARGET=80 SMOOTH_READINGS=3 COOLING_HYSTERESIS=2 SAVE=1")
        assert read_speed(host) == pytest.approx(0.733, abs=0.02)
        for bad, error in (("POINTS=40", "degrees:speed"), ("POINTS=40:2", "speeds"),
                           ("TARGET=45", "below target_temp"),
                           ("POINTS=40:0 TARGET=95", "out of"), ("SAVE=2", "at most")):
            with pytest.raises(ApiError, match=error):
                host.script(command + bad)
        status = host.status("temperature_fan electronics")
        assert status["points"] == [[40.0, 0.5], [50.0, 0.6]]
        assert status["target"] == 80.0
        host.script("SAVE_CONFIG RESTART=0")

    def find(host):
        status = host.status("temperature_fan electronics")
        assert status["points"] == [[40.0, 0.5], [50.0, 0.6]]
        assert status["target"] == 80.0
        settings = host.status("configfile")["settings"]["temperature_fan electronics"]
        assert settings["smooth_readings"] == 3
        assert settings["cooling_hysteresis"] == 2.0

    host.run_boots(change, find)
