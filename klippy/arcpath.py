# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an arc leads: a part of a circle, or of a helix around a fixed axis.

Axes are 0, 1, 2 for x, y, z.  The plane lies at right angles to the axis
`normal`; angles grow from x to y, y to z, z to x.  Units: mm, rad.
"""

import math

import cython

if cython.compiled:
    from cython.cimports.libc.math import cos, sin
else:
    from math import cos, sin

QUARTER = 0.5 * math.pi


class ArcPath:
    """From start to end (x, y, z) around the middle (a, b) of the plane.

    sweep: how far it turns, positive or negative.  Both ends must be at the
    same distance from the middle; they are kept as they are given.
    """

    def __init__(self, start, end, middle, sweep, normal):
        if not cython.compiled:
            self.first, self.last = [0.] * 3, [0.] * 3
        for axis in range(3):
            self.first[axis], self.last[axis] = start[axis], end[axis]
        self.normal, self.sweep = normal, sweep
        self.axis_a, self.axis_b = (normal + 1) % 3, (normal + 2) % 3
        self.center_a, self.center_b = middle
        arm_a = start[self.axis_a] - middle[0]
        arm_b = start[self.axis_b] - middle[1]
        self.angle = math.atan2(arm_b, arm_a)
        self.radius = math.hypot(arm_a, arm_b)
        way = self.radius * abs(sweep)
        self.length = math.hypot(way, end[normal] - start[normal])
        self.turn = sweep / self.length
        self.flat = way / self.length
        self.curvature = self.flat * abs(self.turn)

    def find_point(self, share):
        """[x, y, z] after a share (0..1) of the way."""
        angle = self.angle + self.sweep * share
        rise = self.last[self.normal] - self.first[self.normal]
        point = [0.] * 3
        point[self.axis_a] = self.center_a + self.radius * cos(angle)
        point[self.axis_b] = self.center_b + self.radius * sin(angle)
        point[self.normal] = self.first[self.normal] + rise * share
        return point

    def find_direction(self, share):
        """[x, y, z] of length 1, after a share of the way."""
        angle = self.angle + self.sweep * share
        flat = self.flat if self.sweep > 0. else -self.flat
        direction = [0.] * 3
        direction[self.axis_a] = -flat * sin(angle)
        direction[self.axis_b] = flat * cos(angle)
        direction[self.normal] = (
            self.last[self.normal] - self.first[self.normal]) / self.length
        return direction

    def find_direction_along(self, share, rx, ry, rz):
        """How much of the direction there lies along another one."""
        x, y, z = self.find_direction(share)
        return x * rx + y * ry + z * rz

    def find_box(self):
        """[(least, greatest)] of x, y, z on the way."""
        box = [(min(a, b), max(a, b))
               for a, b in zip(self.start, self.end, strict=True)]
        for axis, middle, top in ((self.axis_a, self.center_a, 0.),
                                  (self.axis_b, self.center_b, QUARTER)):
            low, high = box[axis]
            if self.passes(top):
                high = max(high, middle + self.radius)
            if self.passes(top + math.pi):
                low = min(low, middle - self.radius)
            box[axis] = low, high
        return box

    def find_steepest(self, axis):
        """Greatest part of the direction along an axis."""
        if axis == self.normal:
            return abs(self.last[axis] - self.first[axis]) / self.length
        top = 0. if axis == self.axis_a else QUARTER
        if self.passes(top + QUARTER) or self.passes(top - QUARTER):
            return self.flat
        return max(abs(self.find_direction(share)[axis]) for share in (0., 1.))

    def find_pull(self, axis):
        """Greatest part of the direction to the middle along an axis."""
        if axis == self.normal:
            return 0.
        top = 0. if axis == self.axis_a else QUARTER
        if self.passes(top) or self.passes(top + math.pi):
            return 1.
        return max(abs(cos(self.angle + turned - top)) for turned in (0., self.sweep))

    def find_nearest(self, axis_a, axis_b):
        """Least and greatest distance, over the way, from a line along the normal.

        axis_a, axis_b: where that line is in the plane.
        """
        ends = [math.hypot(point[self.axis_a] - axis_a, point[self.axis_b] - axis_b)
                for point in (self.start, self.end)]
        off_a, off_b = axis_a - self.center_a, axis_b - self.center_b
        away, toward = math.hypot(off_a, off_b), math.atan2(off_b, off_a)
        near, far = min(ends), max(ends)
        if self.passes(toward):
            near = min(near, abs(away - self.radius))
        if self.passes(toward + math.pi):
            far = max(far, away + self.radius)
        return near, far

    def passes(self, angle):
        """True if the arc comes by this angle."""
        ahead = angle - self.angle if self.sweep > 0. else self.angle - angle
        return ahead % (2. * math.pi) <= abs(self.sweep)

    @property
    def start(self):
        """(x, y, z) where it begins."""
        return self.first[0], self.first[1], self.first[2]

    @property
    def end(self):
        """(x, y, z) where it ends."""
        return self.last[0], self.last[1], self.last[2]
