# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves near the centre of a bed that turns, by the rules of the motion page."""

import dataclasses
import itertools
import math

import numpy as np

from truth.plan import allow
from truth.steps import check_steps

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


def span_arc(arc, start, end):
    """As span(), of a truth.gcode.Round around a vertical axis."""
    ends = math.hypot(*start[:2]), math.hypot(*end[:2])
    off = math.hypot(*arc.middle)
    far = math.atan2(arc.middle[1], arc.middle[0])
    low, high = sorted((arc.angle, arc.angle + arc.sweep))

    def passes(angle):
        return (angle - low) % (2. * math.pi) <= high - low
    near = abs(off - arc.radius) if passes(far + math.pi) else min(ends)
    return min(near, *ends), off + arc.radius if passes(far) else max(ends)


def cut(wanted, bed_speed):
    """The Wanted between two rests, with those near the centre in parts."""
    parts = []
    for w in wanted:
        parts += cut_one(w, bed_speed)
    return parts


def cut_one(w, bed_speed):
    move = allow(w)
    if move is None or w.arc is not None:
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


class BedJudge:
    """Steps of a bed on a path that comes near its centre.

    Outside of the core each step is exact.  Within it the bed turns the shorter
    way round, in one direction a visit, and no faster than `rate` (rad/s).
    """

    def __init__(self, path, step_dist, tick, rate, sample=1e-4):
        self.path, self.step_dist, self.tick, self.rate = path, step_dist, tick, rate
        self.at = np.arange(path.t0[0] - 0.1, path.t1[-1] + 0.1, sample)
        places = path.xyz(self.at)
        self.is_out = np.hypot(places[:, 0], places[:, 1]) > CORE

    def check(self, times, directions, count, origin):
        """count: before the first step; origin: angle at count 0.  Visits, steps."""
        edges = np.nonzero(np.diff(self.is_out))[0]
        borders = [0, *(edges + 1), len(self.at)]
        done, self.visits = 0, []
        for low, high in itertools.pairwise(borders):
            last = np.searchsorted(times, self.at[high - 1], side="right")
            part = slice(done, last)
            args = times[part], directions[part], count, origin
            if self.is_out[low]:
                self._check_outside(*args, self.at[low:high])
            else:
                self._check_core(*args, self.at[low:high])
            count += int(np.sum(directions[part]))
            done = last
        return len(self.visits)

    def _check_outside(self, times, directions, count, origin, at):
        places = self.path.xyz(at)
        angles = np.unwrap(np.arctan2(places[:, 1], places[:, 0]))
        is_at = origin + count * self.step_dist
        angles += 2. * np.pi * np.round((is_at - angles[0]) / (2. * np.pi))
        assert abs(angles[0] - is_at) < 2. * self.step_dist + self.rate * 2e-4

        def exact(t):
            p = self.path.xyz(t)
            near = np.interp(t, at, angles)
            angle = np.arctan2(p[:, 1], p[:, 0])
            return angle + 2. * np.pi * np.round((near - angle) / (2. * np.pi)) - origin
        # next to the core a sample, or the window of a step, is within it
        edge = 2.5e-4
        keep = (times > at[0] + edge) & (times < at[-1] - edge)
        first = np.argmax(keep) if keep.any() else 0
        bad, _ = check_steps(times[keep], directions[keep],
                             count + int(np.sum(directions[:first])), exact,
                             self.step_dist, self.tick)
        assert not len(bad), (len(bad), keep.sum(), times[keep][bad[0]])

    def _check_core(self, times, directions, count, origin, at):
        self.visits.append((at[0], at[-1], len(times)))
        assert len(times) <= np.pi / self.step_dist + 3
        assert abs(int(np.sum(directions))) >= len(times) - 2
        for width in (1e-3, 1e-2):
            within = np.searchsorted(times, times + width) - np.arange(len(times))
            limit = self.rate * width / self.step_dist + 2
            assert not len(times) or within.max() <= limit, (within.max(), limit)
