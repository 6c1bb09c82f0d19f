# SPDX-License-Identifier: GPL-3.0-or-later
"""verify_heater against courses of temperature."""
import pytest
from bench_printer import Printer

from klippy.extras import verify_heater
from klippy.simulator import thermal


class WatchedHeater:
    def __init__(self):
        self.temp, self.target = 25.0, 0.0
        self.n_expired = self.n_cuts = 0
        self.is_cut = False

    def get_temp(self, eventtime):
        return self.temp, self.target

    def lookup_heater(self, name):
        return self


@pytest.fixture
def setup():
    printer = Printer()
    heater = printer.objects["heaters"] = WatchedHeater()
    section = printer.make_section("verify_heater extruder")
    verify_heater.load_config_prefix(section)
    printer.start()
    return printer, heater


def run(printer, heater, course, seconds):
    """Set heater.temp = course(t) each second; returns s until a fault."""
    for t in range(seconds):
        heater.temp = course(t)
        printer.advance(1.0)
        if printer.is_shutdown():
            return t
    return None


def test_heater_that_does_not_warm_up_is_caught(setup):
    printer, heater = setup
    heater.target = 200.0
    seconds = run(printer, heater, lambda t: 25.0, 100)
    assert 19 <= seconds <= 22
    assert "extruder not heating at expected rate" in printer.shutdown_message
    assert "verify_heater extruder" in printer.shutdown_message


def test_normal_warm_up_is_left_alone(setup):
    printer, heater = setup
    model = thermal.HeaterModel(thermal.HOTEND, 25.0)
    heater.target = 210.0

    def course(t):
        model.advance(1.0, 1.0 if model.sensor_temperature < 210.0 else 0.25)
        return model.sensor_temperature
    assert run(printer, heater, course, 400) is None


def test_sensor_that_falls_out_is_caught(setup):
    printer, heater = setup
    heater.target = 200.0
    assert run(printer, heater, lambda t: min(25 + 4 * t, 200), 80) is None
    seconds = run(printer, heater, lambda t: max(200 - 2 * t, 25), 200)
    assert seconds is not None and seconds < 30


def test_a_heater_that_was_off_meanwhile_has_time_to_warm_up(setup):
    printer, heater = setup
    heater.target = 200.0
    run(printer, heater, lambda t: min(25 + 4 * t, 200), 80)
    heater.n_expired += 1
    assert run(printer, heater, lambda t: min(100 + 2 * t, 200), 100) is None
    heater.n_expired += 1
    assert 19 <= run(printer, heater, lambda t: 100.0, 100) <= 22


def test_short_dip_is_forgiven(setup):
    printer, heater = setup
    heater.target = 200.0
    run(printer, heater, lambda t: min(25 + 4 * t, 200), 80)
    assert run(printer, heater, lambda t: 188 if t < 10 else 200, 300) is None


def test_lower_target_is_no_fault(setup):
    printer, heater = setup
    heater.target = 200.0
    run(printer, heater, lambda t: min(25 + 4 * t, 200), 80)
    heater.target = 100.0
    assert run(printer, heater, lambda t: max(200 - t, 100), 300) is None


def test_heater_off_is_not_watched(setup):
    printer, heater = setup
    assert run(printer, heater, lambda t: 25.0 - 0.1 * t, 100) is None


def test_nothing_is_checked_in_batch_mode():
    printer = Printer()
    printer.start_args["debugoutput"] = "x"
    verify_heater.load_config_prefix(
        printer.make_section("verify_heater extruder"))
    printer.start()
    assert printer.timers == []


def test_bed_has_a_longer_gain_time():
    printer = Printer()
    for name, seconds in (("heater_bed", 60.0), ("extruder", 20.0)):
        check = verify_heater.load_config_prefix(
            printer.make_section("verify_heater " + name))
        assert check.check_gain_time == seconds


def test_time_without_power_by_the_watchdog_is_no_slow_climb(setup):
    printer, heater = setup
    heater.target = 200.0
    assert run(printer, heater, lambda t: 25.0 + 2.0 * t, 60) is None
    heater.is_cut, heater.n_cuts = True, 1
    assert run(printer, heater, lambda t: 140.0, 60) is None
    heater.is_cut = False
    # from then on it counts again
    assert 19 <= run(printer, heater, lambda t: 140.0, 60) <= 22
