# SPDX-License-Identifier: GPL-3.0-or-later
"""[gcode_arcs]: G2 and G3, as arcs or as short straight moves."""

import math

import cython

from klippy.arcpath import ArcPath

if cython.compiled:
    from cython.cimports.libc.math import cos, sin
else:
    from math import cos, sin

# Orders of the axes: a, b of the plane, c at right angles to it
PLANES = {"G17": ("IJ", (0, 1, 2)), "G18": ("IK", (0, 2, 1)), "G19": ("JK", (1, 2, 0))}
# Ends closer than this (mm) are one point: a full circle
SAME_POINT = 1e-6
# Greatest turn of one move, so that small circles are round
MAX_TURN = math.pi / 8.
MAX_MOVES = 1000000
# Both radii of an arc that is made as one may differ so much (mm), and it may
# be so far off: numbers in files are rounded
ROUNDING = 0.005
# Smaller radii (mm) are no arcs
MIN_RADIUS = 1e-4
# Angles of a way at which an arc is compared with what was asked for
SHARES = tuple(i / 8. for i in range(1, 8))
# So much (mm) may the ends be further apart than the diameter, for rounding
R_SLACK = 0.002


class Arc:
    """A circular or helical path around center; all points are x, y, z in mm.

    axes: order as in PLANES.  If the end is off the circle, the radius
    changes evenly on the way.
    """

    def __init__(self, start, end, arm, axes, is_clockwise):
        self.axis_a, self.axis_b, self.axis_c = axes
        if not cython.compiled:
            self.start, self.end, self.point = [0.] * 3, [0.] * 3, [0.] * 3
        for axis in range(3):
            self.start[axis] = start[axis]
            self.end[axis] = end[axis]
        self.arm_a, self.arm_b = -arm[0], -arm[1]
        self.center_a = start[self.axis_a] + arm[0]
        self.center_b = start[self.axis_b] + arm[1]
        self._find_angle(is_clockwise)

    def _find_angle(self, is_clockwise):
        end_a = self.end[self.axis_a] - self.center_a
        end_b = self.end[self.axis_b] - self.center_b
        self.radius = math.hypot(self.arm_a, self.arm_b)
        self.end_radius = math.hypot(end_a, end_b)
        angle = math.atan2(self.arm_a * end_b - self.arm_b * end_a,
                           self.arm_a * end_a + self.arm_b * end_b)
        if math.hypot(end_a - self.arm_a, end_b - self.arm_b) < SAME_POINT:
            angle = 0.
        if is_clockwise:
            self.angle = angle - 2. * math.pi if angle >= 0. else angle
        else:
            self.angle = angle + 2. * math.pi if angle <= 0. else angle
        return 0

    def count_moves(self, resolution, chord_error=0.):
        """How many moves are at most resolution mm long and bend little.

        chord_error: most that a move may be off the arc (mm); 0: no limit.
        """
        rise = self.end[self.axis_c] - self.start[self.axis_c]
        length = math.hypot(self.angle * max(self.radius, self.end_radius), rise)
        turn, radius = MAX_TURN, max(self.radius, self.end_radius)
        if 0. < chord_error < radius:
            turn = min(turn, 2. * math.acos(1. - chord_error / radius))
        return max(1, math.ceil(length / resolution - 1e-9),
                   math.ceil(abs(self.angle) / turn - 1e-9))

    def _find_point(self, share):
        turned = self.angle * share
        cosine, sine = cos(turned), sin(turned)
        radius = 1.
        if self.radius > 0.:
            radius += (self.end_radius / self.radius - 1.) * share
        self.point[self.axis_a] = self.center_a + radius * (
            self.arm_a * cosine - self.arm_b * sine)
        self.point[self.axis_b] = self.center_b + radius * (
            self.arm_a * sine + self.arm_b * cosine)
        self.point[self.axis_c] = self.start[self.axis_c] + share * (
            self.end[self.axis_c] - self.start[self.axis_c])
        return 0

    def find_point(self, share):
        """(x, y, z) after a share (0..1) of the way."""
        self._find_point(share)
        return self.point[0], self.point[1], self.point[2]

    def make_path(self):
        """The ArcPath through both ends; None if there is none close to this one.

        The centre is moved to where both ends are at the same distance.
        """
        if (abs(self.end_radius - self.radius) > ROUNDING
                or self.radius < MIN_RADIUS):
            return None
        chord_a = self.end[self.axis_a] - self.start[self.axis_a]
        chord_b = self.end[self.axis_b] - self.start[self.axis_b]
        chord2 = chord_a * chord_a + chord_b * chord_b
        a, b, angle = self.center_a, self.center_b, self.angle
        if chord2 > 0.:
            off = (0.5 * chord2 + self.arm_a * chord_a + self.arm_b * chord_b) / chord2
            a, b = a + off * chord_a, b + off * chord_b
            angle = self._turn_around(a, b)
        if abs(angle - self.angle) > MAX_TURN:
            return None
        # The third axis, around which x to y, y to z, z to x are positive
        is_turned = (self.axis_a + 1) % 3 != self.axis_b
        path = ArcPath(self.start, self.end, (b, a) if is_turned else (a, b),
                       -angle if is_turned else angle, self.axis_c)
        radius = path.radius
        for share in SHARES:
            self._find_point(share)
            off = math.hypot(self.point[self.axis_a] - a,
                             self.point[self.axis_b] - b) - radius
            if abs(off) > ROUNDING:
                return None
        return path

    def _turn_around(self, a, b):
        """The angle between the ends as seen from another centre."""
        from_a, from_b = self.start[self.axis_a] - a, self.start[self.axis_b] - b
        to_a, to_b = self.end[self.axis_a] - a, self.end[self.axis_b] - b
        angle = math.atan2(from_a * to_b - from_b * to_a,
                           from_a * to_a + from_b * to_b)
        return angle + 2. * math.pi * round((self.angle - angle) / (2. * math.pi))

    def run(self, count, start_e, end_e, speed, make_move):
        """Call make_move(x, y, z, e, speed) count times, last with the end."""
        way_e = end_e - start_e
        for index in range(1, count):
            share = index / count
            self._find_point(share)
            make_move(self.point[0], self.point[1], self.point[2],
                      start_e + way_e * share, speed)
        make_move(self.end[0], self.end[1], self.end[2], end_e, speed)


def find_arm(chord, radius, is_clockwise):
    """(a, b) from the start to the centre of an arc of a given radius.

    chord: (a, b) from start to end; radius: negative for the longer way.
    Returns None if there is no such arc.
    """
    length = math.hypot(*chord)
    reach = abs(radius)
    if length < SAME_POINT or length > 2. * reach + R_SLACK:
        return None
    height = math.sqrt(max(reach * reach - 0.25 * length * length, 0.)) / length
    if is_clockwise == (radius > 0.):
        height = -height
    return [0.5 * chord[0] - height * chord[1], 0.5 * chord[1] + height * chord[0]]


class ArcSupport:
    """G2 and G3 in the plane that G17, G18 or G19 has chosen."""

    def __init__(self, config):
        printer = config.get_printer()
        self.resolution = config.getfloat("resolution", 1., above=0.)
        self.chord_error = config.getfloat("chord_error", 0., minval=0.)
        self.spiral_tolerance = config.getfloat("spiral_tolerance", 0.5, minval=0.)
        self.is_native = config.getboolean("native", True)
        self.gcode_move = printer.load_object(config, "gcode_move")
        self.letters, self.axes = PLANES["G17"]
        register = printer.lookup_object("gcode").register_command
        register("G2", self.cmd_G2)
        register("G3", self.cmd_G3)
        for name in PLANES:
            register(name, self.cmd_plane)

    def cmd_plane(self, gcmd):
        """G17, G18, G19: choose the plane of the arcs to come."""
        self.letters, self.axes = PLANES[gcmd.get_command()]

    def cmd_G2(self, gcmd):
        """Arc, clockwise."""
        self._run_arc(gcmd, True)

    def cmd_G3(self, gcmd):
        """Arc, counter-clockwise."""
        self._run_arc(gcmd, False)

    def _run_arc(self, gcmd, is_clockwise):
        gcode_move = self.gcode_move
        if not gcode_move.absolute_coord:
            raise gcmd.error("G2/G3 does not support relative move mode (G91):"
                             " use G90")
        start, end = gcode_move.last_position, self._read_end(gcmd)
        arm = self._read_arm(gcmd, start, end, is_clockwise)
        speed = self._read_speed(gcmd)
        arc = Arc(start[:3], end[:3], arm, self.axes, is_clockwise)
        self._check_spiral(gcmd, arc)
        if self.is_native and self._run_native(arc, end[3], speed):
            return
        count = arc.count_moves(self.resolution, self.chord_error)
        if count > MAX_MOVES:
            raise gcmd.error("Error on '%s': the arc would need %d moves (at most %d)"
                             % (gcmd.get_commandline(), count, MAX_MOVES))
        gcode_move.speed = speed
        arc.run(count, start[3], end[3], speed, gcode_move.make_move)

    def _check_spiral(self, gcmd, arc):
        """Raise a CommandError if both ends are too far from one circle."""
        off = abs(arc.end_radius - arc.radius)
        if off > self.spiral_tolerance + R_SLACK:
            raise gcmd.error(
                "Error on '%s': the end is %.3f mm from the centre, the start %.3f mm,"
                " which differs by %.3f mm (at most %.3f). Is the centre (%s) given"
                " from the start of the arc? For spirals raise 'spiral_tolerance' in"
                " [gcode_arcs]"
                % (gcmd.get_commandline(), arc.end_radius, arc.radius, off,
                   self.spiral_tolerance, ", ".join(self.letters)))

    def _run_native(self, arc, end_e, speed):
        """Have the arc made as one move; False if that is not possible here."""
        gcode_move = self.gcode_move
        toolhead = gcode_move.find_arc_target()
        if toolhead is None:
            return False
        path = arc.make_path()
        if (path is None or not toolhead.can_follow(path)
                or toolhead.get_position()[:3] != list(path.start)):
            return False
        gcode_move.speed = speed
        gcode_move.make_arc(toolhead, path, end_e, speed)
        return True

    def _read_arm(self, gcmd, start, end, is_clockwise):
        """From start to centre, in the plane: [a, b]."""
        letters = " and ".join(self.letters)
        arm = [gcmd.get_float(letter, 0.) for letter in self.letters]
        radius = gcmd.get_float("R", None)
        if radius is None:
            if not any(arm):
                raise gcmd.error("G2/G3 requires IJ, IK or JK parameters: the centre,"
                                 " by %s in this plane; or R" % (letters,))
            return arm
        if any(arm):
            raise gcmd.error("Error on '%s': give the arc's centre by %s or its"
                             " radius by R, not both"
                             % (gcmd.get_commandline(), letters))
        chord = [end[axis] - start[axis] for axis in self.axes[:2]]
        arm = find_arm(chord, radius, is_clockwise)
        if arm is None:
            raise gcmd.error(
                "Error on '%s': no arc of radius %.3f leads over %.3f mm; R must be"
                " at least half of that, and the ends must differ"
                % (gcmd.get_commandline(), radius, math.hypot(*chord)))
        return arm

    def _read_end(self, gcmd):
        """Where the arc ends, in positions of the head: [x, y, z, e]."""
        gcode_move = self.gcode_move
        end = list(gcode_move.last_position[:4])
        for axis, letter in enumerate("XYZE"):
            value = gcmd.get_float(letter, None)
            if value is None:
                continue
            origin = gcode_move.base_position
            if letter == "E":
                value *= gcode_move.extrude_factor
                if not gcode_move.absolute_extrude:
                    origin = gcode_move.last_position
            end[axis] = value + origin[axis]
        return end

    def _read_speed(self, gcmd):
        if gcmd.get("F", None) is None:
            return self.gcode_move.speed
        return self.gcode_move.read_speed(gcmd)


def load_config(config):
    return ArcSupport(config)
