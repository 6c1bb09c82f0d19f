# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed and acceleration of each axis, on machines of the kinds limited_*.

Units: mm/s, mm/s^2.  The command is SET_KINEMATICS_LIMIT.
"""

import math

COMMAND = "SET_KINEMATICS_LIMIT"


class AxisLimits:
    """What x and y may do, beside what the head may do along its way.

    are_motors_shared: two motors drive both axes together, so what one axis
    takes of their force the other lacks.
    """

    def __init__(self, toolhead, config, move_limits, are_motors_shared):
        self.move_limits = move_limits
        self.are_motors_shared = are_motors_shared
        velocity, accel = toolhead.get_max_velocity()
        self.velocities, self.accels = [
            [config.getfloat("max_%s_%s" % (axis, what), default, above=0.)
             for axis in "xy"]
            for what, default in (("velocity", velocity), ("accel", accel))]
        self.is_scaled = config.getboolean("scale_xy_accel", False)
        config.get_printer().lookup_object("gcode").register_command(
            COMMAND, self.cmd_SET_KINEMATICS_LIMIT,
            desc=self.cmd_SET_KINEMATICS_LIMIT_help)

    def check_move(self, move):
        """Slow a move down where x or y cannot follow."""
        if not (move.d_x or move.d_y):
            return
        length = move.move_d
        rx, ry = abs(move.d_x) / length, abs(move.d_y) / length
        vx, vy = self.velocities
        # What a mm/s along the way takes of the limits, as shares of them
        speed_share = max(rx / vx, ry / vy)
        move.limit_speed(1. / speed_share, self.find_accel(rx, ry, move.accel))

    def check_arc(self, move):
        """As check_move(), by the greatest parts of x and y anywhere on an arc.

        So are those of the acceleration towards the middle.
        """
        arc = move.arc
        rx, ry = arc.find_steepest(0), arc.find_steepest(1)
        wanted = move.accel
        if rx or ry:
            vx, vy = self.velocities
            move.limit_speed(1. / max(rx / vx, ry / vy),
                             self.find_accel(rx, ry, wanted))
        rx, ry = arc.find_pull(0), arc.find_pull(1)
        if rx or ry:
            pull = self.find_accel(rx, ry, wanted)
            move.limit_speed(math.sqrt(pull / arc.curvature), move.accel)

    def find_accel(self, rx, ry, wanted):
        """Greatest acceleration along a way with these parts of x and y.

        wanted: the acceleration that the printer is set to.
        """
        ax, ay = self.accels
        shares = rx / ax, ry / ay
        accel = 1. / (sum(shares) if self.are_motors_shared else max(shares))
        if self.is_scaled:
            accel *= min(1., wanted / math.hypot(ax, ay))
        return accel

    def change(self, gcmd):
        """Take X_VELOCITY, Y_VELOCITY, X_ACCEL, Y_ACCEL; True if any is there."""
        given = [gcmd.get_float(name, None, above=0.)
                 for name in ("X_VELOCITY", "Y_VELOCITY", "X_ACCEL", "Y_ACCEL")]
        old = self.velocities + self.accels
        new = [before if value is None else value
               for value, before in zip(given, old, strict=True)]
        self.velocities, self.accels = new[:2], new[2:]
        return any(value is not None for value in given)

    cmd_SET_KINEMATICS_LIMIT_help = "Set limits of speed and acceleration by axis"

    def cmd_SET_KINEMATICS_LIMIT(self, gcmd):
        """Change limits for the moves to come, and tell them."""
        z = self.move_limits
        velocities, accels = [
            [gcmd.get_float("%s_%s" % (axis, what), old, above=0.)
             for axis, old in zip("XYZ", values, strict=True)]
            for what, values in (
                ("VELOCITY", [*self.velocities, z.max_z_velocity]),
                ("ACCEL", [*self.accels, z.max_z_accel]))]
        self.is_scaled = bool(gcmd.get_int("SCALE", int(self.is_scaled),
                                           minval=0, maxval=1))
        *self.velocities, z.max_z_velocity = velocities
        *self.accels, z.max_z_accel = accels
        gcmd.respond_info("x, y, z velocity: %s\nx, y, z accel: %s\nscale_xy_accel: %d"
                          % (_join(velocities), _join(accels), self.is_scaled))

    def get_status(self):
        """max_x_velocity ... max_y_accel and scale_xy_accel of toolhead."""
        return {"max_x_velocity": self.velocities[0],
                "max_y_velocity": self.velocities[1],
                "max_z_velocity": self.move_limits.max_z_velocity,
                "max_x_accel": self.accels[0], "max_y_accel": self.accels[1],
                "max_z_accel": self.move_limits.max_z_accel,
                "scale_xy_accel": self.is_scaled}


def _join(values):
    return " ".join("%.3f" % value for value in values)


class LimitedAxes:
    """To be put before a machine's class: the machine with AxisLimits."""

    def limit_axes(self, toolhead, config, *, are_motors_shared=False):
        """Read the options; once, before the first move."""
        self.axis_limits = AxisLimits(toolhead, config, self.limits,
                                      are_motors_shared)

    def check_move(self, move):
        """As the machine's, and slows the move down for x and y."""
        result = super().check_move(move)
        self.axis_limits.check_move(move)
        return result

    def check_arc(self, move):
        """As check_move(), for a move along an arc."""
        result = super().check_arc(move)
        self.axis_limits.check_arc(move)
        return result

    def change_axis_limits(self, gcmd):
        """As the machine's, and what SET_VELOCITY_LIMIT says about x and y."""
        has_z = super().change_axis_limits(gcmd)
        return self.axis_limits.change(gcmd) or has_z

    def get_status(self, eventtime):
        """As the machine's, with the limits of the axes."""
        return super().get_status(eventtime) | self.axis_limits.get_status()
