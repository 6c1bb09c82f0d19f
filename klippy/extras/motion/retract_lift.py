# SPDX-License-Identifier: GPL-3.0-or-later
"""The head goes up while filament is drawn back, unseen by the G-code."""

Z_AXIS = 2


class RetractLift:
    """A transform of the moves that adds a height to z; set up when first used."""

    def __init__(self, printer, gcode_move, ends_with_z_moves):
        """ends_with_z_moves: a move with another z goes there without a lift."""
        self.printer, self.gcode_move = printer, gcode_move
        self.ends_with_z_moves = ends_with_z_moves
        self.next_transform = None
        self.lift = self.last_z = 0.
        printer.register_event_handler("homing:home_rails_end", self._handle_homing)
        printer.register_event_handler("stepper_enable:motor_off",
                                       lambda print_time: self.forget())

    def _handle_homing(self, homing_state, rails):
        if Z_AXIS in homing_state.get_axes():
            self.forget()

    def _is_homed(self):
        toolhead = self.printer.lookup_object("toolhead")
        now = self.printer.get_reactor().monotonic()
        return "z" in toolhead.get_kinematics().get_status(now)["homed_axes"]

    def change(self, lift):
        """Go up or down until the head is lifted by so many mm.

        Nothing happens while z is not homed.  Raises CommandError out of range.
        """
        if lift == self.lift or not self._is_homed():
            return
        if self.next_transform is None:
            self.next_transform = self.gcode_move.set_move_transform(self, force=True)
        position = list(self.next_transform.get_position())
        position[Z_AXIS] += lift - self.lift
        self.next_transform.move(position, self.gcode_move.speed)
        self.lift = lift
        self.last_z = position[Z_AXIS] - lift

    def forget(self):
        """Where the head is now is where the G-code has it."""
        if self.lift:
            self.lift = 0.
            self.gcode_move.reset_last_position()

    def get_position(self):
        """Position without the lift."""
        position = list(self.next_transform.get_position())
        position[Z_AXIS] -= self.lift
        self.last_z = position[Z_AXIS]
        return position

    def move(self, newpos, speed):
        """Go to a position, and higher by the lift."""
        if self.ends_with_z_moves and newpos[Z_AXIS] != self.last_z:
            self.lift = 0.
        self.last_z = newpos[Z_AXIS]
        position = list(newpos)
        position[Z_AXIS] += self.lift
        self.next_transform.move(position, speed)
