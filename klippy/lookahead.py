# SPDX-License-Identifier: GPL-3.0-or-later
# cython: boundscheck=False, wraparound=False, cdivision=True
"""Speeds of moves that wait for the next ones: corners, ramps and calm.

A move's speeds are fixed when nothing that may follow can change them, so the
plan depends on the moves alone and not on when they come.  The rules are in
docs/internals/motion.md.  Units: mm, s, (mm/s)^2 for what ends in _v2.
"""

import cython

from klippy.errors import CommandError
from klippy_ext.trapq import TrapMove

if cython.compiled:
    from cython.cimports.libc.math import fabs, fmax, fmin, sqrt
else:
    from math import fabs, sqrt
    fmin, fmax = min, max

# Ways below this (mm) count as none
MIN_WAY = 1e-9
# Accel of moves of extra axes alone until whoever owns the axis limits it
FREE_ACCEL = 1e8
UNLIMITED_V2 = 1e300
# Plan again when moves of so many s have come
PLAN_TIME = 0.25
# How far, relatively, a speed must drop and rise again to part two hills
HILL_DROP = 1e-6


class MotionLimits:
    """What the printer as a whole may do; one object a setting, never changed."""

    def __init__(self, max_velocity, max_accel, min_cruise_ratio, corner_velocity):
        self.max_velocity = max_velocity
        self.max_accel = max_accel
        self.min_cruise_ratio = min_cruise_ratio
        self.corner_velocity = corner_velocity
        self.junction_deviation = (corner_velocity ** 2 * (sqrt(2.) - 1.)
                                   / max_accel)
        self.gentle_accel = max_accel * (1. - min_cruise_ratio)


class Move(TrapMove):
    """One straight move, or an arc, and, once planned, its trapezoid.

    Move(limits, start_pos, end_pos, speed) takes sequences x, y, z, e, ... .
    """

    def __init__(self, limits, start_pos, end_pos, speed):
        if not cython.compiled:
            _clear(self)
        self.start_x, self.start_y, self.start_z, self.start_e = start_pos[:4]
        self.end_x, self.end_y, self.end_z, self.end_e = end_pos[:4]
        if len(end_pos) > 4:
            self.extra = make_extra(start_pos[4:], end_pos[4:])
        self.set_path(limits, speed)

    @property
    def start_pos(self):
        """(x, y, z, e, ...) at the start."""
        return (self.start_x, self.start_y, self.start_z, self.start_e,
                *self._list_extra(0))

    @property
    def end_pos(self):
        """(x, y, z, e, ...) at the end."""
        return (self.end_x, self.end_y, self.end_z, self.end_e, *self._list_extra(1))

    @property
    def axes_d(self):
        """Way of each axis."""
        return [self.d_x, self.d_y, self.d_z, self.d_e, *self._list_extra(2)]

    @property
    def axes_r(self):
        """Way of each axis a mm of the move."""
        return [self.axes_r_x, self.axes_r_y, self.axes_r_z, self.axes_r_e,
                *self._list_extra(3)]

    def _list_extra(self, column):
        return [axis[column] for axis in self.extra or ()]

    def set_path(self, limits, speed):
        """Work out ways and limits from start and end."""
        self.d_x = self.end_x - self.start_x
        self.d_y = self.end_y - self.start_y
        self.d_z = self.end_z - self.start_z
        self.d_e = self.end_e - self.start_e
        self.junction_deviation = limits.junction_deviation
        self.move_d = sqrt(self.d_x * self.d_x + self.d_y * self.d_y
                           + self.d_z * self.d_z)
        self.is_kinematic_move = self.move_d >= MIN_WAY
        velocity = fmin(speed, limits.max_velocity)
        self.accel = limits.max_accel
        gentle = limits.gentle_accel
        if not self.is_kinematic_move:
            self.end_x, self.end_y = self.start_x, self.start_y
            self.end_z = self.start_z
            self.d_x = self.d_y = self.d_z = 0.
            self.move_d = fabs(self.d_e)
            if self.extra is not None:
                self.move_d = max(self.move_d, find_longest(self.extra))
            velocity = speed
            self.accel = gentle = FREE_ACCEL
            if self.move_d < MIN_WAY:
                self.move_d = 0.
                return 0
        self.axes_r_x = self.d_x / self.move_d
        self.axes_r_y = self.d_y / self.move_d
        self.axes_r_z = self.d_z / self.move_d
        self.axes_r_e = self.d_e / self.move_d
        if self.extra is not None:
            self.extra = [(a, b, d, d / self.move_d) for a, b, d in self.extra]
        self.min_move_t = self.move_d / velocity
        self.max_cruise_v2 = velocity * velocity
        self.delta_v2 = 2. * self.move_d * self.accel
        self.gentle_v2 = 2. * self.move_d * gentle
        return 0

    def set_arc(self, limits, arc, speed):
        """Follow an ArcPath from start to end instead of the straight line."""
        self.arc, self.move_d = arc, arc.length
        self.turn, self.normal = arc.turn, arc.normal
        self.junction_deviation = limits.junction_deviation
        self.is_kinematic_move = True
        self.d_x, self.d_y = self.end_x - self.start_x, self.end_y - self.start_y
        self.d_z, self.d_e = self.end_z - self.start_z, self.end_e - self.start_e
        self.axes_r_x, self.axes_r_y, self.axes_r_z = arc.find_direction(0.)
        self.axes_r_e = self.d_e / self.move_d
        self.accel = limits.max_accel
        self.max_cruise_v2 = UNLIMITED_V2
        self.gentle_v2 = 2. * self.move_d * limits.gentle_accel
        self.limit_speed(fmin(speed, limits.max_velocity), self.accel)
        return 0

    def limit_speed(self, speed, accel):
        """Keep the move below a speed (mm/s) and an accel (mm/s^2)."""
        self.accel = fmin(self.accel, accel)
        if self.arc is not None:
            # The accel towards the middle counts like that along the way
            speed = fmin(speed, sqrt(self.accel / self.arc.curvature))
        speed2 = speed * speed
        if speed2 < self.max_cruise_v2:
            self.max_cruise_v2 = speed2
            self.min_move_t = self.move_d / speed
        self.delta_v2 = 2. * self.move_d * self.accel
        self.gentle_v2 = fmin(self.gentle_v2, self.delta_v2)
        return 0

    def move_error(self, msg="Move out of range"):
        """The CommandError for this move: `raise move.move_error()`."""
        x, y, z, e, *extra = self.end_pos
        text = "%s: %.3f %.3f %.3f [%.3f]" % (msg, x, y, z, e)
        return CommandError(text + "".join(" %.3f" % v for v in extra))

    def find_corner_v2(self, prev):
        """Greatest speed at the corner between two ways."""
        along = (prev.axes_r_x * self.axes_r_x + prev.axes_r_y * self.axes_r_y
                 + prev.axes_r_z * self.axes_r_z)
        if prev.arc is not None:
            along = prev.arc.find_direction_along(1., self.axes_r_x, self.axes_r_y,
                                                  self.axes_r_z)
        # Of half the angle between the ways: 90 degrees for a straight line
        sine = sqrt(0.5 * (1. + along)) if along > -1. else 0.
        cosine = sqrt(0.5 * (1. - along)) if along < 1. else 0.
        # Straight but for rounding (2e-6 rad); a literal is free of look-ups
        if cosine <= 1e-6 or sine >= 1.:
            return fmin(self.max_cruise_v2, prev.max_cruise_v2)
        radius = sine / (1. - sine)
        corner = fmin(radius * self.junction_deviation * self.accel,
                      radius * prev.junction_deviation * prev.accel)
        # A round of which both moves are tangents must fit between them
        return fmin(corner, 0.25 * (sine / cosine) * fmin(self.delta_v2,
                                                          prev.delta_v2))

    def calc_junction(self, prev, extra_v2):
        """Set the most the speed can be at the start, after prev.

        extra_v2: what the extra axes allow.
        """
        if not (self.is_kinematic_move and prev.is_kinematic_move):
            return 0
        v2 = fmin(self.find_corner_v2(prev), extra_v2)
        v2 = fmin(v2, fmin(self.max_cruise_v2, prev.max_cruise_v2))
        self.max_start_v2 = fmin(v2, prev.max_start_v2 + prev.delta_v2)
        self.max_gentle_v2 = fmin(self.max_start_v2,
                                  prev.max_gentle_v2 + prev.gentle_v2)
        return 0

    def forget_junction(self):
        """Let the move start from rest, as if it was the first."""
        self.max_start_v2 = self.max_gentle_v2 = 0.
        return 0

    def set_profile(self, end_v2):
        """Make the trapezoid from the plan at the start and at the end."""
        cap = fmin(self.cap_v2, self.max_cruise_v2)
        start_v2 = fmin(self.full_v2, cap)
        end_v2 = fmin(end_v2, cap)
        cruise_v2 = fmin(cap, 0.5 * (start_v2 + end_v2 + self.delta_v2))
        cruise_v2 = fmax(cruise_v2, fmax(start_v2, end_v2))
        half_inv_accel = 0.5 / self.accel
        way = self.move_d - half_inv_accel * (2. * cruise_v2 - start_v2 - end_v2)
        self.start_v = sqrt(start_v2)
        self.cruise_v = sqrt(cruise_v2)
        end_v = sqrt(end_v2)
        self.accel_t = (self.cruise_v - self.start_v) / self.accel
        self.decel_t = (self.cruise_v - end_v) / self.accel
        self.cruise_t = way / self.cruise_v if way > 0. else 0.
        return 0

    def calc_position(self, time):
        """(x, y, z, e) so long (s) after its start, once it is planned."""
        t = max(time, 0.)
        up = min(t, self.accel_t)
        flat = min(max(t - self.accel_t, 0.), self.cruise_t)
        down = min(max(t - self.accel_t - self.cruise_t, 0.), self.decel_t)
        way = ((self.start_v + 0.5 * self.accel * up) * up + self.cruise_v * flat
               + (self.cruise_v - 0.5 * self.accel * down) * down)
        way = min(way, self.move_d)
        if self.arc is not None:
            return (*self.arc.find_point(way / self.move_d),
                    self.start_e + self.axes_r_e * way)
        return (self.start_x + self.axes_r_x * way, self.start_y + self.axes_r_y * way,
                self.start_z + self.axes_r_z * way, self.start_e + self.axes_r_e * way)

    def add_callback(self, callback):
        """Call callback(print_time of the end) when the move is planned."""
        if self.timing_callbacks is None:
            self.timing_callbacks = []
        self.timing_callbacks.append(callback)


def make_extra(starts, ends):
    """[(start, end, way)] of the extra axes."""
    return [(a, b, b - a) for a, b in zip(starts, ends, strict=True)]


def find_longest(extra):
    """Longest way of the extra axes."""
    return max(abs(way) for _, _, way in extra)


def make_move(limits, x0, y0, z0, e0, x1, y1, z1, e1, extra, speed):
    """A Move without a detour through sequences."""
    move = Move.__new__(Move)
    if not cython.compiled:
        _clear(move)
    move.start_x, move.start_y, move.start_z, move.start_e = x0, y0, z0, e0
    move.end_x, move.end_y, move.end_z, move.end_e = x1, y1, z1, e1
    move.extra = extra
    move.set_path(limits, speed)
    return move


def make_arc_move(limits, arc, start_e, end_e, speed):
    """A Move along an ArcPath."""
    move = Move.__new__(Move)
    if not cython.compiled:
        _clear(move)
    move.start_x, move.start_y, move.start_z = arc.start
    move.end_x, move.end_y, move.end_z = arc.end
    move.start_e, move.end_e = start_e, end_e
    move.set_arc(limits, arc, speed)
    return move


def _clear(move):
    """Attributes that the compiled class has from the start."""
    move.arc = move.extra = move.timing_callbacks = None
    move.max_start_v2 = move.max_gentle_v2 = move.axes_r_e = 0.
    move.min_move_t = move.max_cruise_v2 = move.delta_v2 = move.gentle_v2 = 0.


class LookAheadQueue:
    """Moves whose speeds may still change, in order."""

    def __init__(self, plan_time=PLAN_TIME):
        """plan_time: plan again when moves of so many s have come."""
        self.plan_time = plan_time
        self.reset()

    def reset(self):
        """Forget all moves; the next one starts from rest."""
        self.queue = []
        self.time_left = self.plan_time
        self.hill_top = self.last_top = 0.
        self.next_full_v2 = self.next_calm_v2 = 0.

    def __len__(self):
        return len(self.queue)

    def is_empty(self):
        """True if no move waits."""
        return not self.queue

    def get_last(self):
        """The newest move, or None."""
        return self.queue[len(self.queue) - 1] if self.queue else None

    def add_move(self, move):
        """Add a move (with its junction set); True when it is time to plan."""
        self.queue.append(move)
        self.time_left -= move.min_move_t
        return self.time_left <= 0.

    def take(self, is_final):
        """Plan, and remove and return the moves whose speeds are certain.

        is_final: no more moves come for now, the last one ends at rest.
        """
        self.time_left = self.plan_time
        if not self.queue:
            return self.queue[:0]
        count = self.plan_backwards(is_final)
        count = self.cap_hills(count, is_final)
        for i in range(count):
            move = self.queue[i]
            move.set_profile(self.find_end_full(i))
        taken = self.queue[:count]
        del self.queue[:count]
        if is_final:
            self.reset()
        return taken

    def plan_stop(self):
        """Plan all moves so that the last ends at rest, and keep them all.

        take() plans anew: nothing is decided by this.
        """
        hill_top, last_top = self.hill_top, self.last_top
        self.cap_hills(self.plan_backwards(True), True)
        for i in range(len(self.queue)):
            move = self.queue[i]
            move.set_profile(self.find_end_full(i))
        self.hill_top, self.last_top = hill_top, last_top

    def restart(self, count):
        """Drop count moves: the rest, which is returned, starts from rest.

        Its junctions but the first are to be set again.
        """
        moves = self.queue[count:]
        self.reset()
        for move in moves:
            move.forget_junction()
            self.add_move(move)
        return moves

    def plan_backwards(self, is_final):
        """Set the plan at each start, with rest at the end.

        Returns the number of moves at both ends of which it is certain.
        """
        full = calm = 0.
        n = len(self.queue)
        n_full = n_calm = n if is_final else 0
        for k in range(n):
            i = n - 1 - k
            move = self.queue[i]
            full += move.delta_v2
            calm += move.gentle_v2
            if move.max_start_v2 <= full:
                full = move.max_start_v2
                if i > n_full:
                    n_full = i
            if move.max_gentle_v2 <= calm:
                calm = move.max_gentle_v2
                if i > n_calm:
                    n_calm = i
            move.full_v2, move.calm_v2 = full, calm
        return min(n_full, n_calm)

    def find_end_full(self, i):
        """The plan at the end of move i."""
        if i + 1 >= len(self.queue):
            return 0.
        move = self.queue[i + 1]
        return move.full_v2

    def find_end_calm(self, i):
        """The calm plan at the end of move i."""
        if i + 1 >= len(self.queue):
            return 0.
        move = self.queue[i + 1]
        return move.calm_v2

    def cap_hills(self, count, is_final):
        """Set how fast each of the first count moves may cruise.

        Returns the number of moves of which that is certain.
        """
        first = 0
        hill_top, last_top = self.hill_top, self.last_top
        for i in range(count):
            move = self.queue[i]
            calm = move.calm_v2
            top = fmin(move.max_cruise_v2,
                       0.5 * (calm + self.find_end_calm(i) + move.gentle_v2))
            move.cap_v2 = top
            if is_valley(last_top, calm, top):
                for j in range(first, i):
                    other = self.queue[j]
                    other.cap_v2 = hill_top
                first, hill_top = i, 0.
            if top > hill_top:
                hill_top = top
            last_top = top
        return self.close_hill(first, count, hill_top, is_final)

    def close_hill(self, first, count, hill_top, is_final):
        """Cap the last hill, which may go on; returns the number taken."""
        end = count
        for i in range(first, count):
            move = self.queue[i]
            top = move.cap_v2
            end_full = self.find_end_full(i)
            peak = 0.5 * (move.full_v2 + end_full + move.delta_v2)
            # Rounding must not let the cap touch start or end only sometimes
            peak = fmax(peak, fmax(move.full_v2, end_full))
            if not is_final and hill_top < fmin(move.max_cruise_v2, peak):
                end = i
                break
            self.last_top = top
            move.cap_v2 = hill_top
        if end > first:
            self.hill_top = hill_top
        elif first > 0:
            self.hill_top = self.last_top = 0.
        return end


def is_valley(left, bottom, right):
    """True if a profile falls from left to bottom and rises again to right."""
    return (left - bottom > HILL_DROP * left
            and right - bottom > HILL_DROP * right)
