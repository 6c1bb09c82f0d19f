# SPDX-License-Identifier: GPL-3.0-or-later
"""[heater_watchdog] stops a simulated printer whose heater or sensor breaks."""
import types

import heating_machine as machine
import pytest

CONFIG = machine.COMMON + machine.PID + machine.BED + machine.PID.replace(
    "21.657", "60").replace("2.888", "0.5").replace("40.608", "600") + """
[heater_watchdog extruder]
[heater_watchdog heater_bed]
"""


class Stuck:
    """The output of a heater that is always on, or never."""

    def __init__(self, duty):
        self.duty = duty

    def read_duty(self):
        return self.duty


def find(it, name):
    return next(h for h in it.machine.thermal.heaters if h.name == name)


def find_input(it, name):
    model = find(it, name).model
    return next(i for i in it.machine.thermal.inputs if i.heater is model)


def wait_shutdown(it, seconds):
    """(s until the shutdown, its message)."""
    start = it.world.monotonic()
    while it.world.monotonic() - start < seconds:
        it.pause(0.5)
        if it.printer.is_shutdown():
            it.pause(1.0)
            return it.world.monotonic() - start - 1.0, it.printer.state_message
    raise AssertionError("no shutdown within %.0f s" % seconds)


@pytest.fixture
def run(tmp_path, monkeypatch):
    def run(body, config=CONFIG):
        machine.HeatingBench(tmp_path, monkeypatch, config).run_ready(body)
    return run


def warm_up(it):
    it.send("M104 S210")
    it.pause(160.0)
    assert it.get("heater_watchdog extruder")["state"] == "watching"


@pytest.mark.parametrize("name,seconds", [("extruder", 15.0), ("heater_bed", 90.0)])
def test_heater_that_is_stuck_on_while_off(run, name, seconds):
    def body(it):
        it.pause(120.0)
        find(it, name).output = Stuck(1.0)
        elapsed, message = wait_shutdown(it, 200.0)
        assert elapsed < seconds
        assert "Heater %s gets warmer" % name in message
        assert "cut the power supply" in message
    run(body)


def test_heater_that_is_stuck_on_while_holding(run):
    def body(it):
        warm_up(it)
        output = find(it, "extruder").output
        find(it, "extruder").output = Stuck(1.0)
        elapsed, message = wait_shutdown(it, 60.0)
        assert "gets warmer" in message and it.block() < 280.0
        # what can be turned off is off
        output.read_duty()
        it.pause(1.0)
        assert output.read_duty() == 0.0
    run(body)


def test_sensor_stuck_below_the_target(run):
    """verify_heater never sees it: 4 degrees are within its hysteresis."""
    def body(it):
        warm_up(it)
        find_input(it, "extruder").heater = types.SimpleNamespace(
            sensor_temperature=206.0)
        elapsed, message = wait_shutdown(it, 120.0)
        assert "does not follow its power" in message and it.block() < 320.0
    run(body)


def test_sensor_stuck_when_the_print_ends(run):
    def body(it):
        warm_up(it)
        find_input(it, "extruder").heater = types.SimpleNamespace(
            sensor_temperature=210.0)
        it.send("M104 S0")
        assert "without the power for it" in wait_shutdown(it, 180.0)[1]
    run(body)


def test_sensors_of_bed_and_hotend_swapped(run):
    def body(it):
        it.pause(100.0)
        hotend, bed = find_input(it, "extruder"), find_input(it, "heater_bed")
        hotend.heater, bed.heater = bed.heater, hotend.heater
        it.send("M104 S210")
        elapsed, message = wait_shutdown(it, 60.0)
        assert elapsed < 15.0 and it.block() < 90.0
        assert "Heater heater_bed gets warmer" in message
        assert "belongs to another heater" in message
    run(body)


def test_loose_wire(run):
    def body(it):
        warm_up(it)
        real = find(it, "extruder").model

        class Loose:
            @property
            def sensor_temperature(self):
                is_open = int(it.world.monotonic() / 0.7) % 3 == 0
                return real.sensor_temperature - (40.0 if is_open else 0.0)
        find_input(it, "extruder").heater = Loose()
        assert wait_shutdown(it, 60.0)[0] < 30.0
    run(body)


@pytest.mark.parametrize("control", [machine.PID, machine.CALIBRATED])
def test_a_print_is_left_alone(run, control):
    def body(it):
        it.send("M140 S60\nM104 S210")
        it.pause(300.0)
        it.send("M104 S240\nM106 S255")
        it.pause(40.0)
        it.send("M106 S100\nM83\nG1 E150 F300")
        it.pause(40.0)
        it.send("M107\nM104 S195\nM140 S80")
        it.pause(200.0)
        it.send("M104 S0\nM140 S0\nM106 S255")
        it.pause(300.0)
        assert not it.printer.is_shutdown(), it.printer.state_message
        for name in ("extruder", "heater_bed"):
            assert it.get("heater_watchdog " + name)["state"] == "watching"
    run(body, CONFIG.replace(machine.PID, control, 1))


def test_measured_values_are_used_at_once(run):
    def body(it):
        it.pause(1.0)
        assert it.get("heater_watchdog extruder") == {
            "state": "watching", "rate": 4.0,
            "hold": pytest.approx(0.065 / 40, abs=1e-6), "is_probing": False,
            "is_cut": False, "n_cuts": 0}
        assert it.get("heater_watchdog heater_bed")["state"] == "learning"
    run(body, CONFIG.replace(machine.PID, machine.CALIBRATED, 1))


@pytest.mark.parametrize("section", [
    "", "[heater_watchdog extruder]\nenable: False\n"])
def test_heater_that_is_not_watched(run, section):
    def body(it):
        it.pause(60.0)
        find(it, "extruder").output = Stuck(1.0)
        it.pause(30.0)
        assert it.block() > 100.0 and not it.printer.is_shutdown()
    run(body, CONFIG.replace("[heater_watchdog extruder]\n", section))


def test_fan_can_be_named(run):
    def body(it):
        it.send("SET_FAN_SPEED FAN=other SPEED=0.7")
        it.pause(2.0)
        watchdog = it.printer.lookup_object("heater_watchdog extruder")
        assert watchdog.surroundings.fan_speed == 0.7
        assert it.get("heater_watchdog extruder")["state"] == "learning"
    run(body, CONFIG.replace("[heater_watchdog extruder]", """
[fan_generic other]
pin: PH3
[heater_watchdog extruder]
cooling_fan: fan_generic other
"""))


def test_unknown_heater_is_named(tmp_path, monkeypatch):
    bench = machine.HeatingBench(tmp_path, monkeypatch,
                                 CONFIG + "[heater_watchdog chamber]\n")

    def body(it):
        assert it.printer.state == "error"
        assert "Unknown heater 'chamber'" in it.printer.state_message
    bench.run(body)


def test_sensor_that_becomes_slow_while_cold(run):
    """The power is cut before the block is above max_temp, not only when it shows."""
    def body(it):
        warm_up(it)
        it.send("M104 S0")
        it.pause(600.0)
        find_input(it, "extruder").heater = Slow(it, find(it, "extruder").model, 30.0)
        it.send("M104 S260")
        hottest = max(it.follow(300.0))
        assert it.get("heater_watchdog extruder")["n_cuts"] > 0
        assert hottest < 320.0
    run(body)


class Slow:
    """A sensor that follows its block by so many s."""

    def __init__(self, it, model, lag):
        self.it, self.model, self.lag = it, model, lag
        self.temp, self.last_time = model.temperature, it.world.monotonic()

    @property
    def sensor_temperature(self):
        now = self.it.world.monotonic()
        share = min((now - self.last_time) / self.lag, 1.0)
        self.last_time = now
        self.temp += share * (self.model.temperature - self.temp)
        return self.temp
