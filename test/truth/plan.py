# SPDX-License-Identifier: GPL-3.0-or-later
"""The speeds of moves between two rests, by the rules of the motion page.

A second reading of docs/internals/motion.md: everything is known at once,
every rule is one plain loop, names are those of the page.
"""

import dataclasses
import math

from truth.path import NO_ARC

SHORTEST_WAY = 1e-9
VALLEY_MARGIN = 1e-6
STRAIGHT = 1e-6


@dataclasses.dataclass
class Planned:
    """One move with its trapezoid; mm, mm/s, mm/s^2."""
    start: tuple
    end: tuple
    d: float
    way: tuple                  # mm of (x, y, z, e) a mm of way
    filament_alone: bool
    vmax2: float
    a: float
    g: float
    jd: float
    filament_jump: float
    advance: float = 0.         # pressure advance, s
    arc: object = None          # gcode.Round
    way_end: tuple = ()         # as way, at the end
    v_start: float = 0.
    v_cruise: float = 0.
    v_end: float = 0.

    @property
    def D(self):
        return 2. * self.d * self.a

    @property
    def G(self):
        return min(2. * self.d * self.g, self.D)

    def limit(self, speed, accel):
        self.vmax2 = min(self.vmax2, speed * speed)
        self.a = min(self.a, accel)
        self.g = min(self.g, self.a)


def plan(wanted, extra_limit=None, cut=None):
    """Planned moves for the Wanted between two rests.

    extra_limit(move): what else the machine limits, by move.limit().
    cut(wanted): the same moves in the parts that the machine makes of them.
    """
    if cut is not None:
        wanted = cut(wanted)
    moves = [m for m in (allow(w) for w in wanted) if m is not None]
    if extra_limit is not None:
        for move in moves:
            extra_limit(move)
    for move in moves:
        if move.arc is not None:
            move.vmax2 = min(move.vmax2, move.a / curvature(move))
    set_speeds(moves)
    return moves


def allow(w):
    """What one move is allowed, or None if it leads nowhere."""
    delta = tuple(b - a for a, b in zip(w.start, w.end, strict=True))
    if w.arc is not None:
        return allow_arc(w, delta)
    d, lim = math.hypot(*delta[:3]), w.limits
    alone = d < SHORTEST_WAY
    if alone:
        d, delta = abs(delta[3]), (0., 0., 0., delta[3])
    if not d:
        return None
    accel = 1e8 if alone else lim.max_accel
    vmax = w.speed if alone else min(w.speed, lim.max_velocity)
    jd = lim.corner_velocity ** 2 * (math.sqrt(2.) - 1.) / lim.max_accel
    move = Planned(w.start, w.end, d, tuple(x / d for x in delta), alone, vmax ** 2,
                   accel, accel * (1. - lim.cruise_ratio), jd, lim.filament_jump,
                   w.advance)
    rz, r = abs(move.way[2]), abs(move.way[3])
    if rz:
        move.limit(lim.max_z_velocity / rz, lim.max_z_accel / rz)
    if r and (not any(delta[:2]) or delta[3] < 0.):
        move.limit(lim.filament_velocity / r, lim.filament_accel / r)
    return move


def direction(arc, turned, d, rise):
    """(x, y, z) of the way at an angle from the start of an arc."""
    flat = arc.radius * arc.sweep / d
    way, angle = [0.] * 3, arc.angle + turned
    way[(arc.normal + 1) % 3] = -flat * math.sin(angle)
    way[(arc.normal + 2) % 3] = flat * math.cos(angle)
    way[arc.normal] = rise / d
    return tuple(way)


def curvature(move):
    """1 / mm of the way of an arc, a helix included."""
    flat = move.arc.radius * move.arc.sweep / move.d
    return flat * flat / move.arc.radius


def list_angles(arc):
    """Where an arc may be fastest along an axis: both ends, and quarters."""
    low, high = sorted((arc.angle, arc.angle + arc.sweep))
    return [low, high, *(0.5 * math.pi * i for i in range(-8, 9)
                         if low < 0.5 * math.pi * i < high)]


def list_places(move):
    """Ends of a move; of an arc also where an axis of its plane is outermost."""
    places = [move.start[:3], move.end[:3]]
    if move.arc is not None:
        a, b = (move.arc.normal + 1) % 3, (move.arc.normal + 2) % 3
        for angle in list_angles(move.arc):
            place = list(move.start[:3])
            place[a] = move.arc.middle[0] + move.arc.radius * math.cos(angle)
            place[b] = move.arc.middle[1] + move.arc.radius * math.sin(angle)
            places.append(tuple(place))
    return places


def find_shares(move):
    """Greatest part of the direction along x, y, z, and of that to the middle."""
    if move.arc is None:
        return [abs(r) for r in move.way[:3]], [0.] * 3
    arc, rise = move.arc, move.end[move.arc.normal] - move.start[move.arc.normal]
    angles = list_angles(arc)
    ways = [direction(arc, angle - arc.angle, move.d, rise) for angle in angles]
    pulls = [0.] * 3
    pulls[(arc.normal + 1) % 3] = max(abs(math.cos(angle)) for angle in angles)
    pulls[(arc.normal + 2) % 3] = max(abs(math.sin(angle)) for angle in angles)
    return [max(abs(way[axis]) for way in ways) for axis in range(3)], pulls


def allow_arc(w, delta):
    """What an arc is allowed: all along it, and towards its middle."""
    arc, lim = w.arc, w.limits
    rise = delta[arc.normal]
    d = math.hypot(arc.radius * arc.sweep, rise)
    jd = lim.corner_velocity ** 2 * (math.sqrt(2.) - 1.) / lim.max_accel
    first, last = (direction(arc, turned, d, rise) for turned in (0., arc.sweep))
    r = delta[3] / d
    move = Planned(w.start, w.end, d, (*first, r), False,
                   min(w.speed, lim.max_velocity) ** 2, lim.max_accel,
                   lim.max_accel * (1. - lim.cruise_ratio), jd, lim.filament_jump,
                   w.advance, arc, (*last, r))
    angles = list_angles(arc)
    ways = [direction(arc, angle - arc.angle, d, rise)[2] for angle in angles]
    steep = max(map(abs, ways))
    if steep:
        move.limit(lim.max_z_velocity / steep, lim.max_z_accel / steep)
    if arc.normal != 2:
        middle = math.cos if arc.normal == 1 else math.sin
        pull = max(abs(middle(angle)) for angle in angles)
        move.limit(math.sqrt(lim.max_z_accel / (pull * curvature(move))), move.a)
    if r < 0.:
        move.limit(lim.filament_velocity / -r, lim.filament_accel / -r)
    return move


def find_cos_between(before, after):
    return sum(p * q for p, q in
               zip((before.way_end or before.way)[:3], after.way[:3], strict=True))


def is_nearly_straight(before, after):
    """Whether rounding may decide if there is a corner at all."""
    if before.filament_alone or after.filament_alone:
        return False
    cos_half = math.sqrt(max(0., 0.5 * (1. - find_cos_between(before, after))))
    return 0.5 * STRAIGHT < cos_half < 2. * STRAIGHT


def junction(before, after):
    """J: greatest v2 where two moves meet."""
    if before.filament_alone or after.filament_alone:
        return 0.
    limits = [before.vmax2, after.vmax2]
    cos_between = find_cos_between(before, after)
    # The angle between the ways: 180 degrees if straight on, 0 if back.
    sin_half = math.sqrt(max(0., 0.5 * (1. + cos_between)))
    cos_half = math.sqrt(max(0., 0.5 * (1. - cos_between)))
    if cos_half > STRAIGHT:
        for m in (before, after):
            if sin_half < 1.:
                limits.append(sin_half / (1. - sin_half) * m.jd * m.a)
            limits.append(0.5 * m.d * sin_half / cos_half * m.a)
    change = abs(after.way[3] - before.way[3])
    if change:
        limits.append((after.filament_jump / change) ** 2)
    return min(limits)


def greatest(J, change):
    """Greatest v2 at each junction with |difference| <= change over a move."""
    v2 = list(J)
    for i in reversed(range(len(change))):
        v2[i] = min(v2[i], v2[i + 1] + change[i])
    for i in range(len(change)):
        v2[i + 1] = min(v2[i + 1], v2[i] + change[i])
    return v2


def hill_tops(C, T):
    """For each move the top of its hill; T and C as on the page."""
    tops, first = [], 0
    for i in range(1, len(T) + 1):
        if i == len(T) or (exceeds(T[i - 1], C[i]) and exceeds(T[i], C[i])):
            tops += [max(T[first:i])] * (i - first)
            first = i
    return tops


def exceeds(top, bottom):
    """True if a speed rises enough above a junction to make it a valley."""
    return top - bottom > VALLEY_MARGIN * top


def set_speeds(moves):
    """Give each move its speeds; the whole sequence at once."""
    J = [0., *(junction(p, q) for p, q in zip(moves, moves[1:], strict=False)), 0.]
    S = greatest(J, [m.D for m in moves])
    C = greatest(J, [m.G for m in moves])
    T = [min(m.vmax2, 0.5 * (C[i] + C[i + 1] + m.G)) for i, m in enumerate(moves)]
    for i, (m, top) in enumerate(zip(moves, hill_tops(C, T), strict=True)):
        cap = min(m.vmax2, top)
        start, end = min(S[i], cap), min(S[i + 1], cap)
        cruise = min(cap, 0.5 * (start + end + m.D))
        m.v_start, m.v_cruise, m.v_end = map(math.sqrt, (start, cruise, end))


def pieces(moves, t=0.):
    """Rows of truth.path for planned moves that begin at time t, and the end."""
    rows = []
    for m in moves:
        (x, y, z, e), (rx, ry, rz, re) = m.start, m.way
        advance = m.advance if re > 0. and (rx or ry or m.arc) else 0.
        done = 0.
        for duration, v, accel in phases(m):
            if duration <= 0.:
                continue
            rows.append((t, duration, v, accel, x, y, z, rx, ry, rz, e, re, advance,
                         *locate(m, done)))
            t += duration
            s = (v + 0.5 * accel * duration) * duration
            done += s
            x, y, z, e = x + rx * s, y + ry * s, z + rz * s, e + re * s
    return rows, t


def locate(m, done):
    """Columns of truth.path.ARC_FIELDS for a piece `done` mm after the start."""
    if m.arc is None:
        return NO_ARC
    rate = m.arc.sweep / m.d
    return (m.arc.normal, *m.arc.middle, m.arc.radius, m.arc.angle + rate * done, rate)


def phases(m):
    """(duration, start speed, acceleration) of the three parts of a move."""
    up = (m.v_cruise ** 2 - m.v_start ** 2) / (2. * m.a)
    down = (m.v_cruise ** 2 - m.v_end ** 2) / (2. * m.a)
    level = max(0., m.d - up - down)
    return (((m.v_cruise - m.v_start) / m.a, m.v_start, m.a),
            (level / m.v_cruise, m.v_cruise, 0.),
            ((m.v_cruise - m.v_end) / m.a, m.v_cruise, -m.a))
