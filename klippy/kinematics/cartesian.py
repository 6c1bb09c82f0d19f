# SPDX-License-Identifier: GPL-3.0-or-later
"""Cartesian machines: one motor or more for each axis."""

from klippy import stepper
from klippy.kinematics.limits import AXES, MoveLimits
from klippy_ext.kin_linear import LinearKinematics

WAYS = ((1., 0., 0.), (0., 1., 0.), (0., 0., 1.))


class LinearMachine:
    """Rails that home one axis each; motors move by sums of the axes."""

    def __init__(self, toolhead, config, ways):
        self.printer = config.get_printer()
        self.rails = [stepper.LookupMultiRail(config.getsection("stepper_" + axis))
                      for axis in AXES]
        for rail, way in zip(self.rails, ways, strict=True):
            for motor in rail.get_steppers():
                motor.set_stepper_kinematics(LinearKinematics(*way))
                motor.set_trapq(toolhead.get_trapq())
        max_velocity, max_accel = toolhead.get_max_velocity()
        self.limits = MoveLimits(
            [rail.get_range() for rail in self.rails],
            config.getfloat("max_z_velocity", max_velocity, above=0.,
                            maxval=max_velocity),
            config.getfloat("max_z_accel", max_accel, above=0., maxval=max_accel))
        self.check_move = self.limits.check_move
        self.printer.register_event_handler(
            "stepper_enable:motor_off", self._handle_motor_off)

    def _handle_motor_off(self, print_time):
        self.clear_homing_state("xyz")

    def get_steppers(self):
        """All MCU_steppers."""
        return [s for rail in self.rails for s in rail.get_steppers()]

    def set_position(self, newpos, homing_axes):
        """The head is at newpos; homing_axes ("xyz") are homed by that."""
        for rail in self.rails:
            rail.set_position(newpos)
        for axis in homing_axes:
            self.limits.set_homed(_index(axis))

    def clear_homing_state(self, clear_axes):
        """The axes ("xyz") must be homed again."""
        for axis in clear_axes:
            self.limits.clear_homed(_index(axis))

    def note_z_not_homed(self):
        """Old name for clear_homing_state("z")."""
        self.clear_homing_state("z")

    def home(self, homing_state):
        """Home the axes of the state one after the other."""
        for axis in homing_state.get_axes():
            self.home_axis(homing_state, axis, self.rails[axis])

    def home_axis(self, homing_state, axis, rail):
        """Move a rail to its endstop, from further away than it can be."""
        low, high = rail.get_range()
        info = rail.get_homing_info()
        target = [None] * 4
        target[axis] = info.position_endstop
        start = list(target)
        if info.positive_dir:
            start[axis] -= 1.5 * (info.position_endstop - low)
        else:
            start[axis] += 1.5 * (high - info.position_endstop)
        homing_state.home_rails([rail], start, target)

    def get_status(self, eventtime):
        """homed_axes and ranges."""
        return self.limits.get_status()


def _index(axis):
    return axis if isinstance(axis, int) else AXES.index(axis)


class CartKinematics(LinearMachine):
    """One axis a rail."""

    def __init__(self, toolhead, config):
        super().__init__(toolhead, config, WAYS)

    def calc_position(self, stepper_positions):
        """Position of the head for {stepper name: position}."""
        return [stepper_positions[rail.get_name()] for rail in self.rails]


def load_kinematics(toolhead, config):
    return CartKinematics(toolhead, config)
