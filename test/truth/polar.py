# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves near the centre of a bed that turns, by the rules of the motion page."""

import dataclasses
import math

from truth.plan import allow

CORE = 0.01
SAME = 1e-6


def span(start, end):
    """(least, greatest) distance of a straight way from the centre."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    way2 = dx * dx + dy * dy
    ends = math.hypot(*start[:2]), math.hypot(*end[:2])
    if not way2:
        return math.inf, max(ends)
    share = min(max(-(start[0] * dx + start[1] * dy) / way2, 0.), 1.)
    return math.hypot(start[0] + share * dx, start[1] + share * dy), max(ends)


def cut(wanted, bed_speed):
    """The Wanted between two rests, with those near the centre in parts."""
    parts = []
    for w in wanted:
        parts += cut_one(w, bed_speed)
    return parts


def cut_one(w, bed_speed):
    move = allow(w)
    if move is None:
        return [w]
    speed = math.sqrt(move.vmax2)
    free = speed / bed_speed
    near, far = span(w.start, w.end)
    if near >= free * (1. - SAME) or far <= max(2. * near, CORE) * (1. + SAME):
        return [w]
    radii = [free]
    radii += [CORE * 2 ** k for k in range(40) if CORE * 2 ** k < free]
    shares = sorted(s for radius in radii for s in crossings(w.start, w.end, radius))
    points = [w.start, *(between(w.start, w.end, s) for s in shares), w.end]
    return [dataclasses.replace(w, start=a, end=b, speed=speed)
            for a, b in zip(points, points[1:], strict=False)]


def between(a, b, share):
    return tuple(p + (q - p) * share for p, q in zip(a, b, strict=True))


def crossings(start, end, radius):
    """Shares of a way at which it is at a distance from the centre."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    a, b = dx * dx + dy * dy, start[0] * dx + start[1] * dy
    inside = b * b - a * (start[0] ** 2 + start[1] ** 2 - radius ** 2)
    if inside <= 0.:
        return []
    root = math.sqrt(inside)
    return [s for s in ((-b - root) / a, (-b + root) / a) if 0. < s < 1.]
