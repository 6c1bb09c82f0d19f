# SPDX-License-Identifier: GPL-3.0-or-later
"""Configs of small simulated machines, as text."""

import math

from truth import plan, polar

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


# Of each kind: options of [printer], and the motors with options of their own
CURVED = {
    "deltesian": ("max_z_velocity: 100\nprint_width: 200\nmin_angle: 8\n", {
        "left": "rotation_distance: 40\nendstop_pin: ^PA3\nposition_endstop: 230\n"
                "arm_length: 260\narm_x_length: 150\nhoming_speed: 60\n",
        "right": "rotation_distance: 40\nendstop_pin: ^PB3\n",
        "y": "rotation_distance: 40\nendstop_pin: ^PC3\nposition_endstop: 0\n"
             "position_max: 200\nhoming_speed: 60\n"}),
    "polar": ("max_z_velocity: 15\nmax_z_accel: 200\n", {
        "bed": "gear_ratio: 80:16\n",
        "arm": "rotation_distance: 40\nendstop_pin: ^PB3\nposition_endstop: 150\n"
               "position_max: 150\nhoming_speed: 60\n",
        "z": "rotation_distance: 8\nendstop_pin: ^PC3\nposition_endstop: 0\n"
             "position_min: -2\nposition_max: 150\nhoming_speed: 10\n"}),
    "rotary_delta": (
        "max_z_velocity: 100\nshoulder_radius: 40\nshoulder_height: 400\n"
        "minimum_z_position: -2\n", {
            "a": "gear_ratio: 100:16\nendstop_pin: ^PA3\nposition_endstop: 200\n"
                 "upper_arm_length: 160\nlower_arm_length: 320\nhoming_speed: 60\n",
            "b": "gear_ratio: 100:16\nendstop_pin: ^PB3\n",
            "c": "gear_ratio: 100:16\nendstop_pin: ^PC3\n"}),
    "winch": ("", {
        "a": "rotation_distance: 40\nanchor_x: 0\nanchor_y: -900\nanchor_z: -100\n",
        "b": "rotation_distance: 40\nanchor_x: 800\nanchor_y: 500\nanchor_z: -100\n",
        "c": "rotation_distance: 40\nanchor_x: -800\nanchor_y: 500\nanchor_z: -90\n",
        "d": "rotation_distance: 40\nanchor_x: 10\nanchor_y: 0\nanchor_z: 1500\n"}),
}


def make_curved(kind, advance=0.04, extra=""):
    """A machine of one of the kinds in CURVED."""
    printer, motors = CURVED[kind]
    text = ("[mcu]\nserial: /dev/null\n\n[printer]\nkinematics: %s\nmax_velocity: 200\n"
            "max_accel: 3000\n%s" % (kind, printer))
    for port, (name, options) in zip("ABCD", motors.items(), strict=False):
        text += ("\n[stepper_%s]\nstep_pin: P%s0\ndir_pin: P%s1\nmicrosteps: 16\n%s"
                 % (name, port, port, options))
    return text + make_extruder(advance) + extra


def make_dual(advance=0.04, extra=""):
    """A cartesian machine with a second carriage on x."""
    dual = (MOTOR.format(name="dual_carriage", port="D", distance=40.)
            + SWITCH.format(port="D", stop=260., low=0., high=260., speed=60.)
            + "axis: x\nsafe_distance: 30\n")
    return make_axes("cartesian", advance, dual + extra)


GENERIC = """
[carriage x]
endstop_pin: ^PA3
position_endstop: 0
position_min: -5
position_max: 220
homing_speed: 60

[dual_carriage u]
primary_carriage: x
endstop_pin: ^PD3
position_endstop: 260
position_max: 260
homing_speed: 60

[carriage y]
endstop_pin: ^PB3
position_endstop: 0
position_max: 220
homing_speed: 60

[carriage z]
endstop_pin: ^PC3
position_endstop: 0
position_min: -2
position_max: 200
homing_speed: 10
"""


def make_generic(advance=0.04, extra=""):
    """Motors that mix three axes at weights of their own, and a second x."""
    text = ("[mcu]\nserial: /dev/null\n\n[printer]\nkinematics: generic_cartesian\n"
            "max_velocity: 300\nmax_accel: 4000\nmax_z_velocity: 15\n"
            "max_z_accel: 200\n" + GENERIC)
    for name, port, carriages in (("stepper a", "A", "x+y"), ("stepper b", "B", "u-y"),
                                  ("stepper c", "C", "0.5*y-z"),
                                  ("stepper d", "D", "y+2*z")):
        text += (MOTOR.format(name=name, port=port, distance=40.)
                 + "carriages: %s\n" % carriages)
    return text + make_extruder(advance) + extra


PRINTER_OPTIONS = ("max_accel", "square_corner_velocity", "max_z_accel",
                   "minimum_cruise_ratio")


def find_limits(kind, config):
    """What kinematics limit beyond z; see truth.plan.plan()."""
    return {"delta": limit_at_edge, "deltesian": limit_flat_arms,
            "polar": limit_turning, "limited_cartesian": limit_each_axis,
            "limited_corexy": limit_shared_motors}.get(kind)


LIMITED = ("max_x_velocity: 150\nmax_y_velocity: 70\nmax_x_accel: 2500\n"
           "max_y_accel: 900\n")


def make_limited(kind, advance=0.04, extra=""):
    """One of the kinds limited_*, with LIMITED."""
    text = make_axes(kind, advance, extra)
    return text.replace("[printer]\n", "[printer]\n" + LIMITED)


def limit_each_axis(move, join=max):
    """What LIMITED says, along the way and towards the middle of an arc."""
    ways, pulls = plan.find_shares(move)
    if ways[0] or ways[1]:
        move.limit(1. / max(ways[0] / 150., ways[1] / 70.),
                   1. / join((ways[0] / 2500., ways[1] / 900.)))
    if pulls[0] or pulls[1]:
        accel = 1. / join((pulls[0] / 2500., pulls[1] / 900.))
        move.limit(math.sqrt(accel / plan.curvature(move)), move.a)


def limit_shared_motors(move):
    """The same where both motors drive x and y."""
    limit_each_axis(move, sum)


def limit_at_edge(move, radius=125., arm=250., velocity=300., accel=3000.):
    """Where the opposite carriage of make_delta() is much faster than the head."""
    reach = max(math.hypot(*move.start[:2]), math.hypot(*move.end[:2]))
    distance = radius + reach
    ratio = distance / math.sqrt(arm * arm - distance * distance)
    if ratio > 3. and not move.filament_alone:
        move.limit(velocity * 3. / ratio, accel * 3. / ratio)


def limit_flat_arms(move, reach=150., arm=260., velocity=200., accel=3000.):
    """Where an arm of the deltesian of CURVED lies so flat that it is fast."""
    if not move.way[0]:
        return
    off = reach + max(abs(place[0]) for place in plan.list_places(move))
    ratio = off / math.sqrt(arm * arm - off * off)
    share = 0.25 if ratio > 6. else 0.5 if ratio > 3. else 1.
    move.limit(share * velocity, share * accel)


# Of the bed of CURVED: 50000 steps a second
BED_SPEED = 50000. * 2. * math.pi / (200. * 16. * 5.)


def limit_turning(move):
    """How fast the bed of the polar machine of CURVED can turn."""
    if move.arc is None:
        near, _ = polar.span(move.start, move.end)
    else:
        near, _ = polar.span_arc(move.arc, move.start, move.end)
    if near < polar.CORE * (1. - polar.SAME):
        near = polar.CORE / math.pi     # half round within the core
    if near * BED_SPEED < math.sqrt(move.vmax2) and not move.filament_alone:
        move.limit(near * BED_SPEED, move.a)


def cut_moves(wanted):
    """truth.plan.plan() gets the parts of moves near the centre of a bed."""
    return polar.cut(wanted, BED_SPEED)
