# SPDX-License-Identifier: GPL-3.0-or-later
"""Arcs for the tests of the motion core, described by their middles."""

import math

from hypothesis import strategies as st
from motion_moves import profiles
from motion_rig import make_move, split_move


class ArcMove:
    """From position on, heading somewhere in the plane, around a middle.

    sign: 1 turns from the plane's first axis to its second.  rise: mm along the
    normal a mm of the circle.
    """

    def __init__(self, profile, position, heading, radius, sign, rise, normal):
        self.axes = (normal + 1) % 3, (normal + 2) % 3
        flat = 1. / math.hypot(1., rise)
        self.normal, self.radius, self.position = normal, radius, position
        self.rate = sign * flat / radius
        self.angle = heading - sign * 0.5 * math.pi
        self.middle = [position[axis] - radius * turn(self.angle)
                       for axis, turn in zip(self.axes, (math.cos, math.sin),
                                             strict=True)]
        ratio = [0.] * 3
        ratio[normal] = rise * flat
        ratio[self.axes[0]] = flat * math.cos(heading)
        ratio[self.axes[1]] = flat * math.sin(heading)
        self.ratio = ratio
        self.move = make_move(*profile[:3], position, ratio, *profile[3:])
        self.move.turn, self.move.normal = self.rate, normal

    def find_place(self, s):
        """(x, y, z) after s mm."""
        place = [p + r * s for p, r in zip(self.position, self.ratio, strict=True)]
        angle = self.angle + self.rate * s
        place[self.axes[0]] = self.middle[0] + self.radius * math.cos(angle)
        place[self.axes[1]] = self.middle[1] + self.radius * math.sin(angle)
        return place

    def split(self, t, advance_flag=0.):
        """As motion_rig.split_move()."""
        rows, end, _ = split_move(t, self.move, advance_flag)
        pieces, s = [], 0.
        for row in rows:
            pieces.append((*row[:4], *self.find_place(s), *row[7:], self.normal,
                           *self.middle, self.radius, self.angle + self.rate * s,
                           self.rate))
            duration, v, accel = row[1:4]
            s += v * duration + 0.5 * accel * duration ** 2
        return pieces, end, self.find_place(s)


def add_arc(rig, t, arc):
    """Append an arc to a rig; returns (its end, the position there)."""
    rig.tq.append(t, arc.move)
    pieces, end, position = arc.split(t, rig.advance_flag)
    rig.pieces += pieces
    return end, position


@st.composite
def shapes(draw, normals=(0, 1, 2)):
    """(heading, radius, sign, rise, normal) of an arc."""
    return (draw(st.floats(-math.pi, math.pi)), 10. ** draw(st.floats(-1.5, 3.)),
            draw(st.sampled_from([-1., 1.])),
            draw(st.sampled_from([0., 0., 0.02, -0.5, 3.])),
            draw(st.sampled_from(normals)))


@st.composite
def tours(draw, reach=5., normals=(0, 1, 2), max_size=8):
    """A list of (pause before in s, profile, shape)."""
    return [(draw(st.one_of(st.just(0.), st.floats(1e-6, 0.3))),
             draw(profiles(reach)), draw(shapes(normals)))
            for _ in range(draw(st.integers(1, max_size)))]


def tour(rig, steps, begin):
    """Add all arcs; returns the end time."""
    t, position = begin, rig.start
    for pause, profile, shape in steps:
        t, position = add_arc(rig, t + pause, ArcMove(profile, position, *shape))
    return t
