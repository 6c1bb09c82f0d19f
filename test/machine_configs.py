# SPDX-License-Identifier: GPL-3.0-or-later
"""Configs of small simulated machines, as text."""

import math

MOTOR = """
[{name}]
step_pin: P{port}0
dir_pin: P{port}1
microsteps: 16
rotation_distance: {distance}
"""
SWITCH = """endstop_pin: ^P{port}3
position_endstop: {stop}
position_min: {low}
position_max: {high}
homing_speed: {speed}
"""
HEAT = """nozzle_diameter: 0.4
filament_diameter: 1.75
min_extrude_temp: 0
heater_pin: PE4
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PE5
control: watermark
min_temp: 0
max_temp: 300
"""
BED = """
[heater_bed]
heater_pin: PF4
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PF5
control: watermark
min_temp: 0
max_temp: 130

[fan]
pin: PF6
"""
DELTA_AXIS = """endstop_pin: ^P{port}3
position_endstop: 250
arm_length: 250
homing_speed: 60
"""


def make_extruder(advance):
    """[extruder] with pressure advance (s)."""
    return (MOTOR.format(name="extruder", port="E", distance=22.)
            + HEAT + "pressure_advance: %s\n" % advance)


def make_two_mcus():
    """A cartesian machine whose extruder is on an mcu of its own."""
    main, _, rest = make_axes("cartesian", 0.04, BED).partition("[extruder]")
    extruder, mark, bed = rest.partition("[heater_bed]")
    return (main + "[extruder]" + extruder.replace(": PE", ": tool:PE") + mark + bed
            + "[mcu tool]\nserial: /dev/null\n")


def make_axes(kinematics, advance=0.04, extra=""):
    """A cartesian or corexy machine."""
    text = ("[mcu]\nserial: /dev/null\n\n[printer]\nkinematics: %s\n"
            "max_velocity: 300\nmax_accel: 4000\nmax_z_velocity: 15\n"
            "max_z_accel: 200\n" % kinematics)
    for name, port, distance, low, high, speed in (
            ("stepper_x", "A", 40., -5., 220., 60.),
            ("stepper_y", "B", 40., -5., 220., 60.),
            ("stepper_z", "C", 8., -2., 200., 10.)):
        text += MOTOR.format(name=name, port=port, distance=distance)
        text += SWITCH.format(port=port, stop=0.0, low=low, high=high, speed=speed)
    return text + make_extruder(advance) + extra


def make_delta(advance=0.04, extra=""):
    """A delta machine with arms of 250 mm."""
    text = ("[mcu]\nserial: /dev/null\n\n[printer]\nkinematics: delta\n"
            "max_velocity: 300\nmax_accel: 3000\nmax_z_velocity: 150\n"
            "delta_radius: 125\nminimum_z_position: -5\n")
    for name, port in (("stepper_a", "A"), ("stepper_b", "B"), ("stepper_c", "C")):
        text += MOTOR.format(name=name, port=port, distance=40.)
        text += DELTA_AXIS.format(port=port)
    return text + make_extruder(advance) + extra


PRINTER_OPTIONS = ("max_accel", "square_corner_velocity", "max_z_accel",
                   "minimum_cruise_ratio")


def find_limits(kind, config):
    """What kinematics limit beyond z; see truth.plan.plan()."""
    return limit_at_edge if kind == "delta" else None


def limit_at_edge(move, radius=125., arm=250., velocity=300., accel=3000.):
    """Where the opposite carriage of make_delta() is much faster than the head."""
    reach = max(math.hypot(*move.start[:2]), math.hypot(*move.end[:2]))
    distance = radius + reach
    ratio = distance / math.sqrt(arm * arm - distance * distance)
    if ratio > 3. and not move.filament_alone:
        move.limit(velocity * 3. / ratio, accel * 3. / ratio)
