# SPDX-License-Identifier: GPL-3.0-or-later
"""A board that may be absent: its cable is cut, it is reset, it is not there at the
start.  The printer goes on, and the board is back within 2 s of its return."""

import random

import pytest
from daemon_run import ApiError
from machine_configs import BED, make_axes

OPTIONAL = """
[mcu aux]
serial: /dev/null
is_non_critical: True

[temperature_sensor chamber]
sensor_type: EPCOS 100K B57560G104F
sensor_pin: aux:PE5
min_temp: 0
max_temp: 100

[heater_generic dryer]
heater_pin: aux:PF4
sensor_type: EPCOS 100K B57560G104F
sensor_pin: aux:PF5
control: watermark
min_temp: 0
max_temp: 130

[fan_generic blower]
pin: aux:PA0

[temperature_fan bay]
pin: PB5
sensor_type: EPCOS 100K B57560G104F
sensor_pin: aux:PE6
min_temp: 0
max_temp: 100
control: watermark

[output_pin lamp]
pin: aux:PA1

[neopixel strip]
pin: aux:PA2
chain_count: 2

[filament_switch_sensor runout]
switch_pin: ^aux:PA3
pause_on_runout: False

[gcode_button knob]
pin: ^aux:PA4
press_gcode:
"""
CONFIG = make_axes("cartesian", extra=BED + OPTIONAL + "[virtual_sdcard]\npath: %s\n")
JOB = "G28\nG90\nM83\nG1 X100 Y100 Z5 F6000\n" + "".join(
    "G1 X%d E0.02 F3000\nG1 Y%d E0.02\n" % (80 + i % 40, 80 + i * 7 % 40)
    for i in range(200)) + "M400\n"
END = [119., 113.]
BACK_LIMIT = 2.
# From a board's return to the first readings of its sensors
READ_LIMIT = 2.
SETUP = ("SET_FAN_SPEED FAN=blower SPEED=0.7\nSET_PIN PIN=lamp VALUE=1\n"
         "SET_LED LED=strip RED=1 INDEX=2\n"
         "SET_HEATER_TEMPERATURE HEATER=dryer TARGET=60")


class Aux:
    """The board aux and what its pins do."""

    def __init__(self, host):
        self.host, self.mcu = host, host.machine.mcus["aux"]
        pins = host.machine.get_pin_map("aux")
        self.blower, self.lamp = (
            self.mcu.watch_output(pins[name]) for name in ("PA0", "PA1"))
        self.switch = pins["PA4"]

    def is_gone(self):
        return self.host.status("mcu aux")["non_critical_disconnected"]

    def get_heater(self):
        return next(h for h in self.host.machine.thermal.heaters if "dryer" in h.name)

    def read_blower(self):
        """Share of a second for which the blower is on."""
        self.blower.read_duty()
        self.host.pause(1.)
        return self.blower.read_duty()

    def read_knob(self):
        return self.host.status("gcode_button knob")["state"] == "PRESSED"

    def wait_until(self, is_gone, limit):
        """Wait for its loss or return; returns s."""
        start = self.host.reactor.monotonic()
        while self.is_gone() != is_gone:
            assert self.host.reactor.monotonic() < start + limit
            self.host.pause(0.05)
        return self.host.reactor.monotonic() - start

    def check_works(self):
        """All that is on it does what it was told before."""
        status = self.host.status
        assert not self.is_gone() and self.host.info()["state"] == "ready"
        assert self.read_blower() == pytest.approx(0.7, abs=0.05)
        assert self.lamp.level == 1
        limit = self.host.reactor.monotonic() + READ_LIMIT
        while not status("temperature_sensor chamber")["temperature"]:
            assert self.host.reactor.monotonic() < limit
            self.host.pause(0.1)
        assert 15. < status("temperature_sensor chamber")["temperature"] < 40.
        assert 10. < status("heater_generic dryer")["temperature"] < 80.
        bay = status("temperature_fan bay")
        assert 15. < bay["temperature"] < 40. and bay["speed"] == 0.
        self.host.script("SET_LED LED=strip GREEN=0.5 INDEX=1")

    def check_gone(self):
        status = self.host.status
        assert self.is_gone() and self.host.info()["state"] == "ready"
        assert status("temperature_sensor chamber")["temperature"] is None
        dryer = status("heater_generic dryer")
        assert dryer["target"] == dryer["power"] == dryer["temperature"] == 0.
        # as if it were hot
        assert status("temperature_fan bay")["speed"] == 1.
        with pytest.raises(ApiError, match="Mcu 'aux' is not connected"):
            self.host.script("SET_HEATER_TEMPERATURE HEATER=dryer TARGET=60")
        # these are for later
        self.host.script("SET_FAN_SPEED FAN=blower SPEED=0.7\n"
                         "SET_PIN PIN=lamp VALUE=1\nSET_LED LED=strip BLUE=1\n"
                         "QUERY_FILAMENT_SENSOR SENSOR=runout")


@pytest.fixture
def host(make_host, tmp_path):
    (tmp_path / "job.gcode").write_text(JOB)
    return make_host(CONFIG % (tmp_path,))


def start(host):
    """Use the board, and print; returns the Aux."""
    aux = Aux(host)
    host.script(SETUP)
    host.script("SDCARD_PRINT_FILE FILENAME=job.gcode")
    host.pause(15.)
    aux.check_works()
    return aux


def check_print_ends(host):
    """The print was not disturbed by any of it."""
    while host.status("print_stats")["state"] == "printing":
        host.pause(0.5)
    assert host.status("print_stats")["state"] == "complete"
    assert host.status("toolhead")["position"][:2] == END
    assert host.machine.calc_position()[:2] == pytest.approx(END, abs=0.02)


@pytest.mark.parametrize("seconds", [0.001, 0.02, 0.3, 2., 4., 6., 20., 60.])
def test_cable_cut(host, seconds):
    def body(host):
        aux = start(host)
        aux.mcu.link.cut()
        host.pause(seconds)
        is_long = seconds > 6.
        if is_long:
            aux.check_gone()
            assert aux.get_heater().duty == 0.
        aux.mcu.link.restore()
        restored = host.reactor.monotonic()
        while aux.is_gone() or host.reactor.monotonic() < restored + 0.05:
            assert host.reactor.monotonic() < restored + BACK_LIMIT
            host.pause(0.05)
        aux.check_works()
        if is_long:
            assert host.status("heater_generic dryer")["target"] == 0.
            assert any("Mcu 'aux' is back" in text for text in host.client.output)
        host.script("SET_HEATER_TEMPERATURE HEATER=dryer TARGET=50")
        check_print_ends(host)
        aux.check_works()

    host.run_boots(body)


@pytest.mark.parametrize("seed", range(4))
def test_resets_at_any_point(host, seed):
    """Also a reset while it is being configured after another one."""
    rng = random.Random(seed)

    def body(host):
        aux = start(host)
        for _ in range(6):
            host.pause(rng.uniform(0., 3.) if rng.random() < 0.5
                       else rng.uniform(0., 0.7))
            aux.mcu.reset()
        aux.wait_until(True, 0.5)
        assert aux.wait_until(False, BACK_LIMIT) < BACK_LIMIT
        aux.check_works()
        check_print_ends(host)

    host.run_boots(body)


def test_board_that_is_not_there_at_the_start(host):
    host.machine.mcus["aux"].link.cut()

    def body(host):
        aux = Aux(host)
        assert host.info()["state"] == "ready"
        assert host.reactor.monotonic() < 15.
        aux.check_gone()
        host.script("SDCARD_PRINT_FILE FILENAME=job.gcode")
        host.pause(30.)
        aux.check_gone()
        aux.mcu.link.restore()
        assert aux.wait_until(False, BACK_LIMIT) < BACK_LIMIT
        host.pause(1.)
        aux.check_works()
        check_print_ends(host)

    host.run_boots(body)


def test_restarts_with_and_without_the_board(host):
    aux = []

    def lose_it(host):
        aux.append(start(host))
        aux[0].mcu.link.cut()
        aux[0].wait_until(True, 7.)

    def find_it_absent(host):
        assert host.info()["state"] == "ready"
        aux[0].check_gone()
        aux[0].mcu.link.restore()
        aux[0].wait_until(False, BACK_LIMIT)

    def find_it_there(host):
        assert host.info()["state"] == "ready" and not aux[0].is_gone()
        host.script(SETUP)
        host.pause(1.)
        aux[0].check_works()

    host.run_boots(lose_it, find_it_absent, find_it_there,
                   restart="gcode/firmware_restart")


def test_switch_that_changes_meanwhile(host):
    def body(host):
        aux = Aux(host)
        for before, after in ((1, 0), (0, 1)):
            aux.mcu.set_input(aux.switch, before)
            host.pause(1.)
            assert aux.read_knob() == before
            aux.mcu.link.cut()
            aux.wait_until(True, 7.)
            aux.mcu.set_input(aux.switch, after)
            aux.mcu.link.restore()
            aux.wait_until(False, BACK_LIMIT)
            host.pause(2.5)
            assert aux.read_knob() == after

    host.run_boots(body)


def test_shutdown_of_its_firmware_is_one_of_the_printer(host):
    def body(host):
        host.world.add_ticker(0.01, lambda now: host.machine.mcus["aux"].set_adc(
            host.machine.get_pin_map("aux")["PF5"], 0.))
        for _ in range(100):
            host.pause(0.1)
            if host.info()["state"] == "shutdown":
                break
        assert "MCU 'aux' shutdown: ADC out of range" in host.info()["state_message"]

    host.run_boots(body)


@pytest.mark.parametrize("text,words", [
    ("[mcu]\nserial: /dev/null\nis_non_critical: True\n", "main mcu"),
    ("[extruder_stepper e1]\nextruder:\nstep_pin: aux:PB0\ndir_pin: aux:PB1\n"
     "microsteps: 16\nrotation_distance: 20\n", "steppers"),
    ("[pwm_tool laser]\npin: aux:PB0\n", "steppers"),
    ("[manual_stepper m]\nstep_pin: PG0\ndir_pin: PG1\nmicrosteps: 16\n"
     "rotation_distance: 20\nendstop_pin: aux:PB3\n", "endstops")])
def test_what_may_not_be_absent(make_host, tmp_path, text, words):
    """Steppers and endstops, and what follows the moves, cannot be on such a board."""
    host = make_host(CONFIG % (tmp_path,) + "\n" + text)

    def body(host):
        for _ in range(100):
            if host.info()["state"] == "error":
                break
            host.pause(0.1)
        message = host.info()["state_message"]
        assert words in message and "is_non_critical" in message

    host.run_boots(body)
