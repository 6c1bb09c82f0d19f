# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer with a hotend, a bed and a part fan on the simulated machine."""
import motion_bench

COMMON = motion_bench.CARTESIAN + """
[fan]
pin: PH6
[temperature_sensor room]
sensor_type: PT1000
sensor_pin: PK7
[extruder]
step_pin: PA4
dir_pin: PA6
microsteps: 16
rotation_distance: 32
nozzle_diameter: 0.4
filament_diameter: 1.75
min_extrude_temp: 0
max_extrude_only_distance: 5000
heater_pin: PB4
sensor_type: ATC Semitec 104GT-2
sensor_pin: PK5
min_temp: 0
max_temp: 300
"""
# What the simulated hotend is: J/K, 1/s, W/K (klippy.simulator.thermal.HOTEND)
CAPACITY, RESPONSIVENESS, TRANSFER, FAN_TRANSFER = 10.0, 1 / 1.5, 0.065, 0.03
MPC = """control: mpc
heater_power: 40
cooling_fan: fan
"""
CALIBRATED = MPC + """block_heat_capacity: 10
sensor_responsiveness: 0.6667
ambient_transfer: 0.065
fan_ambient_transfer: 0, 0.015, 0.03
"""
# as PID_CALIBRATE TARGET=210 finds them
PID = """control: pid
pid_kp: 21.657
pid_ki: 2.888
pid_kd: 40.608
"""
BED = """
[heater_bed]
heater_pin: PH5
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PK6
min_temp: 0
max_temp: 130
"""


class HeatingBench(motion_bench.MotionBench):
    """The machine; block(name) is the true temperature."""

    def block(self, name="extruder"):
        return self.model(name).temperature

    def model(self, name="extruder"):
        return next(h.model for h in self.machine.thermal.heaters if h.name == name)

    def heater(self, name="extruder"):
        return self.printer.lookup_object("heaters").lookup_heater(name)

    def follow(self, seconds, name="extruder", step=0.5):
        """True temperatures while time passes."""
        temps = []
        for _ in range(round(seconds / step)):
            self.pause(step)
            temps.append(self.block(name))
        return temps
