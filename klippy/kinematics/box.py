# SPDX-License-Identifier: GPL-3.0-or-later
"""Machines whose head moves within a box, each axis homed and limited by itself."""

from klippy.kinematics.limits import AXES, MoveLimits, list_axes


class BoxMachine:
    """What such kinematics share; one that differs in something overrides it.

    rails: the PrinterRails, from which motors are listed.
    """

    def __init__(self, config, rails):
        self.printer, self.rails = config.get_printer(), rails

    def open_box(self, toolhead, config, ranges):
        """Allow moves within ranges [(least, greatest)] of x, y, z, mm, once homed."""
        velocity, accel = toolhead.get_max_velocity()
        self.limits = MoveLimits(
            ranges,
            config.getfloat("max_z_velocity", velocity, above=0., maxval=velocity),
            config.getfloat("max_z_accel", accel, above=0., maxval=accel))
        self.printer.register_event_handler("stepper_enable:motor_off",
                                            self._handle_motor_off)

    def _handle_motor_off(self, print_time):
        self.clear_homing_state(AXES)

    def get_steppers(self):
        """All MCU_steppers."""
        return [motor for rail in self.rails for motor in rail.get_steppers()]

    def change_axis_limits(self, gcmd):
        """Take what SET_VELOCITY_LIMIT says about z; True if it does."""
        velocity = gcmd.get_float("Z_VELOCITY", None, above=0.)
        accel = gcmd.get_float("Z_ACCEL", None, above=0.)
        if velocity is not None:
            self.limits.max_z_velocity = velocity
        if accel is not None:
            self.limits.max_z_accel = accel
        return velocity is not None or accel is not None

    # Homing state

    def set_position(self, newpos, homing_axes=""):
        """The head is at newpos; the homing_axes ("xyz") become homed by that."""
        for rail in self.rails:
            rail.set_position(newpos)
        self.set_homed(list_axes(homing_axes))

    def set_homed(self, axes):
        """The axes (indexes) are homed."""
        for axis in axes:
            self.limits.set_homed(axis)

    def clear_homing_state(self, clear_axes):
        """The axes ("xyz") must be homed again."""
        for axis in list_axes(clear_axes):
            self.limits.clear_homed(axis)

    def note_z_not_homed(self):
        """Old name of clear_homing_state("z")."""
        self.clear_homing_state("z")

    # Moves

    def check_move(self, move):
        """Raises CommandError if a move leaves the box; slows one in z."""
        return self.limits.check_move(move)

    def accepts_arc(self, arc):
        """True: motors follow every arc."""
        return True

    def check_arc(self, move):
        """As check_move(), for a move along an arc."""
        return self.limits.check_arc(move)

    def get_status(self, eventtime):
        """homed_axes, axis_minimum, axis_maximum of printer.toolhead."""
        return self.limits.get_status()
