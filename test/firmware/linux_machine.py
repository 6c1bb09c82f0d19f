# SPDX-License-Identifier: GPL-3.0-or-later
"""A small printer around the linux firmware: three axes with endstops, a hotend.

The fake board counts the steps and closes the endstops; a thread here heats the
hotend by what its pin did, and tells the analog input.
"""

import json
import math
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time

from linux_board import ROOT, LinuxProcess
from linux_fakeio import FakeIo

HEATER, SENSOR = "gpio20", "analog0"
AMBIENT, HEATING, COOLING = 25., 25., .05   # degC, degC/s, 1/s
PULLUP, R25, BETA, KELVIN = 4700., 100000., 3950., 273.15
THERMAL_STEP = .02  # s
TIMEOUT = 180.      # s

RULES = """
stepper x gpio1 gpio2
stepper y gpio4 gpio5
stepper z gpio7 gpio8
switch gpio3 1 below -400 x 1
switch gpio6 1 below -800 y 1
switch gpio9 1 below -200 z 1
"""

CONFIG = """
[mcu]
%(link)s

[printer]
kinematics: cartesian
max_velocity: 100
max_accel: 1000

[stepper_x]
step_pin: gpio1
dir_pin: gpio2
endstop_pin: ^gpio3
microsteps: 16
rotation_distance: 40
position_endstop: 0
position_max: 100
homing_speed: 80

[stepper_y]
step_pin: gpio4
dir_pin: gpio5
endstop_pin: ^gpio6
microsteps: 16
rotation_distance: 40
position_endstop: 0
position_max: 100
homing_speed: 80

[stepper_z]
step_pin: gpio7
dir_pin: gpio8
endstop_pin: ^gpio9
microsteps: 16
rotation_distance: 8
position_endstop: 0
position_max: 100
homing_speed: 20

[heater_generic hotend]
gcode_id: T0
heater_pin: gpio20
sensor_type: Generic 3950
sensor_pin: analog0
control: watermark
min_temp: 0
max_temp: 250
"""


def calc_fraction(temperature):
    """Reading of the thermistor at a temperature in degC, 0..1."""
    resistance = R25 * math.exp(
        BETA * (1. / (temperature + KELVIN) - 1. / (25. + KELVIN)))
    return resistance / (resistance + PULLUP)


class Hotend(threading.Thread):
    """Heats while its pin is on."""

    def __init__(self, io):
        super().__init__(daemon=True)
        self.io = io
        self.temperature = AMBIENT
        self.is_ending = threading.Event()
        io.set_adc(SENSOR, calc_fraction(self.temperature))

    def run(self):
        then, on = time.monotonic(), self.io.on_seconds(HEATER)
        while not self.is_ending.wait(THERMAL_STEP):
            now, total = time.monotonic(), self.io.on_seconds(HEATER)
            self.temperature += (HEATING * max(total - on, 0.) - COOLING * (
                now - then) * (self.temperature - AMBIENT))
            self.io.set_adc(SENSOR, calc_fraction(self.temperature))
            then, on = now, total

    def stop(self):
        self.is_ending.set()
        self.join()


class Printer:
    """The host as a process, and a client of its API socket."""

    def __init__(self, folder):
        self.log = folder / "klippy.log"
        self.path = str(folder / "api")
        self.process = subprocess.Popen(
            [sys.executable, "-m", "klippy", "run", str(folder / "printer.cfg"),
             "-a", self.path, "-l", str(self.log), "-n"],
            cwd=ROOT, stdin=subprocess.DEVNULL)
        self.socket, self.last_id = None, 0
        self.connect()

    def connect(self):
        """Connect to the socket as soon as there is one."""
        end = time.monotonic() + TIMEOUT
        self.rest = b""
        while True:
            self.socket = socket.socket(socket.AF_UNIX)
            try:
                self.socket.connect(self.path)
                return
            except OSError:
                self.socket.close()
                assert time.monotonic() < end and self.process.poll() is None
                time.sleep(.05)

    def restart(self, method):
        """RESTART or FIRMWARE_RESTART: the host hangs up and starts again."""
        try:
            self.call(method)
            while True:
                self._read()
        except ConnectionError:
            self.socket.close()
        self.connect()

    def call(self, method, **params):
        """Result of one request; raises RuntimeError with the error's text."""
        self.last_id += 1
        self.socket.sendall(json.dumps(dict(
            id=self.last_id, method=method, params=params)).encode() + b"\x03")
        while True:
            answer = self._read()
            if answer.get("id") == self.last_id:
                break
        if "error" in answer:
            raise RuntimeError(answer["error"]["message"])
        return answer["result"]

    def _read(self):
        end = time.monotonic() + 2 * TIMEOUT
        while b"\x03" not in self.rest:
            left = end - time.monotonic()
            assert left > 0 and select.select([self.socket], [], [], left)[0]
            data = self.socket.recv(65536)
            if not data:
                raise ConnectionError("the host has hung up")
            self.rest += data
        text, self.rest = self.rest.split(b"\x03", 1)
        return json.loads(text)

    def gcode(self, script):
        return self.call("gcode/script", script=script)

    def status(self, name):
        return self.call("objects/query", objects={name: None})["status"][name]

    def wait_state(self, state):
        """Wait for the printer's state, such as "ready".

        The host may hang up once more while it restarts.
        """
        end = time.monotonic() + TIMEOUT
        info = {}
        while info.get("state") != state:
            assert time.monotonic() < end, info
            try:
                info = self.call("info")
            except ConnectionError:
                self.socket.close()
                self.connect()
            time.sleep(.05)
        return info

    def stop(self):
        self.socket.close()
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(TIMEOUT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Machine:
    """Firmware, fake board, hotend and host, with all files in one folder."""

    def __init__(self, program, folder, *options, config=""):
        """config: more of the printer.cfg."""
        (folder / "rules").write_text(RULES)
        self.run = LinuxProcess(program, folder, *options)
        assert self.run.process.poll() is None, self.run.read_errors()
        (folder / "printer.cfg").write_text(
            CONFIG % {"link": self.open_link()} + config)
        self.io = FakeIo(folder)
        self.hotend = Hotend(self.io)
        self.hotend.start()
        self.printer = Printer(folder)

    def open_link(self):
        """What the printer.cfg says of the way to the firmware."""
        return "serial: " + self.run.link

    def positions(self):
        """mm of x, y, z as the motors have moved."""
        return [self.io.stepper(i)[0] / steps
                for i, steps in enumerate((80., 80., 400.))]

    def stop(self):
        self.printer.stop()
        self.hotend.stop()
        status = self.run.stop()
        self.io.close()
        assert not os.path.lexists(self.run.link)
        return status
