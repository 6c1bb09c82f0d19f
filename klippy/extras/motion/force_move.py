# SPDX-License-Identifier: GPL-3.0-or-later
"""[force_move]: moves of one motor, whatever the kinematics say."""

import logging
import math

from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.trapq import TrapMove, TrapQ

BUZZ_COUNT = 10
BUZZ_DISTANCE = 1.
BUZZ_ANGLE = math.radians(1.)
BUZZ_TIME = 0.250
BUZZ_SHORT_REST, BUZZ_LONG_REST = 0.050, 0.450
# s of rest around switching a motor
SWITCH_REST = 0.100
ORIGIN = (0., 0., 0.)


def calc_move_time(dist, speed, accel):
    """How to go a way from rest to rest: speed up, cruise, slow down.

    dist: mm, of either sign.  accel: mm/s^2; 0 for a start and stop at speed.
    Returns (direction, s of speeding up and again of slowing down, s of
    cruising, speed reached).
    """
    direction = math.copysign(1., dist)
    way = abs(dist)
    if not way or not accel:
        return direction, 0., way / speed, speed
    speed = min(speed, math.sqrt(way * accel))
    accel_t = speed / accel
    return direction, accel_t, way / speed - accel_t, speed


def make_segment(dist, speed, accel):
    """A TrapMove along x from 0, and its duration (s)."""
    direction, accel_t, cruise_t, cruise_v = calc_move_time(dist, speed, accel)
    move = TrapMove()
    move.accel_t = move.decel_t = accel_t
    move.cruise_t, move.cruise_v = cruise_t, cruise_v
    move.start_v = 0. if accel_t else cruise_v
    move.accel, move.axes_r_x = accel, direction
    return move, 2. * accel_t + cruise_t


class ForceMove:
    """Object force_move: the steppers by the name of their section."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.steppers = {}
        self.motion_queuing = self.printer.load_object(config, "motion_queuing")
        self.is_enabled = config.getboolean("enable_force_move", False)
        self.gcode = self.printer.lookup_object("gcode")
        if self.is_enabled:
            self.gcode.register_command(
                "SET_KINEMATIC_POSITION", self.cmd_SET_KINEMATIC_POSITION,
                desc=self.cmd_SET_KINEMATIC_POSITION_help)

    def register_stepper(self, config, mcu_stepper):
        """Offer the commands for a stepper."""
        name = mcu_stepper.get_name()
        self.steppers[name] = mcu_stepper
        names = ("STEPPER_BUZZ", "FORCE_MOVE") if self.is_enabled else (
            "STEPPER_BUZZ",)
        for command in names:
            self.gcode.register_mux_command(
                command, "STEPPER", name, getattr(self, "cmd_" + command),
                desc=getattr(self, "cmd_%s_help" % (command,)))

    def lookup_stepper(self, name):
        """The MCU_stepper of a name.  Raises ConfigError if unknown."""
        if name not in self.steppers:
            raise self.printer.config_error(
                "There is no stepper '%s', only %s"
                % (name, ", ".join(self.steppers) or "none"))
        return self.steppers[name]

    # Moves

    def manual_move(self, stepper, dist, speed, accel=0.):
        """Move a stepper by dist mm after all motion; it is not homed by that.

        The commanded position stays: only the mcu's count of steps changes.
        """
        toolhead = self.printer.lookup_object("toolhead")
        move, duration = make_segment(dist, speed, accel)
        trapq = TrapQ()
        toolhead.flush_step_generation()
        old_kinematics = stepper.set_stepper_kinematics(LinearKinematics(1., 0., 0.))
        old_trapq = stepper.set_trapq(trapq)
        try:
            stepper.set_position(ORIGIN)
            print_time = toolhead.get_last_move_time()
            trapq.append(print_time, move)
            self.motion_queuing.note_mcu_movequeue_activity(print_time + duration)
            toolhead.dwell(duration)
            toolhead.flush_step_generation()
        finally:
            stepper.set_trapq(old_trapq)
            stepper.set_stepper_kinematics(old_kinematics)

    def _force_enable(self, stepper):
        """Switch a motor on; returns what to disable later, if it was off."""
        enable = self.printer.lookup_object("stepper_enable").lookup_enable(
            stepper.get_name())
        if enable.is_motor_enabled():
            return None
        toolhead = self.printer.lookup_object("toolhead")
        enable.motor_enable(toolhead.get_last_move_time())
        toolhead.dwell(SWITCH_REST)
        return enable

    def _restore_enable(self, enable):
        if enable is not None:
            toolhead = self.printer.lookup_object("toolhead")
            toolhead.dwell(SWITCH_REST)
            enable.motor_disable(toolhead.get_last_move_time())
            toolhead.dwell(SWITCH_REST)

    # Commands

    cmd_STEPPER_BUZZ_help = "Move a stepper to and fro, to find out which it is"

    def cmd_STEPPER_BUZZ(self, gcmd):
        """Move motor STEPPER ten times 1 mm (or 1 degree) and back."""
        stepper = self.lookup_stepper(gcmd.get("STEPPER"))
        logging.info("buzzing stepper '%s'", stepper.get_name())
        toolhead = self.printer.lookup_object("toolhead")
        dist = BUZZ_ANGLE if stepper.units_in_radians() else BUZZ_DISTANCE
        enable = self._force_enable(stepper)
        for _ in range(BUZZ_COUNT):
            self.manual_move(stepper, dist, dist / BUZZ_TIME)
            toolhead.dwell(BUZZ_SHORT_REST)
            self.manual_move(stepper, -dist, dist / BUZZ_TIME)
            toolhead.dwell(BUZZ_LONG_REST)
        self._restore_enable(enable)

    cmd_FORCE_MOVE_help = "Move one stepper, without any check"

    def cmd_FORCE_MOVE(self, gcmd):
        """Move motor STEPPER by DISTANCE at VELOCITY with ACCEL."""
        stepper = self.lookup_stepper(gcmd.get("STEPPER"))
        distance = gcmd.get_float("DISTANCE")
        speed = gcmd.get_float("VELOCITY", above=0.)
        accel = gcmd.get_float("ACCEL", 0., minval=0.)
        logging.info("forced move of stepper '%s': distance %.3f, velocity %.3f,"
                     " accel %.3f", stepper.get_name(), distance, speed, accel)
        self._force_enable(stepper)
        self.manual_move(stepper, distance, speed, accel)

    cmd_SET_KINEMATIC_POSITION_help = "Declare where the head is"

    def cmd_SET_KINEMATIC_POSITION(self, gcmd):
        """Take the head to be at X, Y, Z, with the axes SET_HOMED homed.

        The axes CLEAR_HOMED (old name: CLEAR) need homing after that.
        """
        toolhead = self.printer.lookup_object("toolhead")
        toolhead.get_last_move_time()
        position = list(toolhead.get_position())
        for axis, letter in enumerate("XYZ"):
            position[axis] = gcmd.get_float(letter, position[axis])
        homed = pick_axes(gcmd.get("SET_HOMED", "xyz"))
        cleared = gcmd.get("CLEAR_HOMED", None)
        if cleared is None:
            cleared = gcmd.get("CLEAR", "")
        cleared = pick_axes(cleared)
        logging.info("SET_KINEMATIC_POSITION %s homed '%s' cleared '%s'",
                     " ".join("%.3f" % v for v in position[:3]), homed, cleared)
        toolhead.set_position(position, homing_axes=homed)
        toolhead.get_kinematics().clear_homing_state(cleared)


def pick_axes(text):
    """The letters of x, y and z that are in a text."""
    return "".join(axis for axis in "xyz" if axis in text.lower())


def load_config(config):
    return ForceMove(config)
