# SPDX-License-Identifier: GPL-3.0-or-later
"""Stepper positions of machines that turn or hang, the slow and plain way."""

import math

import numpy as np


def cable(anchor):
    """Distance of the head from a point."""
    return lambda p: np.sqrt(((p - np.array(anchor)) ** 2).sum(axis=1))


def radius(p):
    """Distance of the head from the z axis."""
    return np.hypot(p[:, 0], p[:, 1])


def rotary_arm(shoulder_radius, shoulder_height, direction, upper, lower):
    """Angle of an upper arm, by the triangle of shoulder, elbow and head.

    The lower arm is seen from the side, shortened by how far it leans out of
    the plane in which the upper arm swings.
    """
    def angle(p):
        out = p[:, 0] * math.cos(direction) + p[:, 1] * math.sin(direction)
        aside = p[:, 1] * math.cos(direction) - p[:, 0] * math.sin(direction)
        out, down = out - shoulder_radius, shoulder_height - p[:, 2]
        seen2 = lower ** 2 - aside ** 2
        reach = np.hypot(out, down)
        at_shoulder = np.arccos((upper ** 2 + reach ** 2 - seen2)
                                / (2. * upper * reach))
        return at_shoulder + np.arctan2(out, down) - 0.5 * math.pi
    return angle


def deltesian_carriage(arm, tower_x):
    """Height of a carriage whose arm swings in the plane of x and z."""
    return lambda p: p[:, 2] + np.sqrt(arm ** 2 - (p[:, 0] - tower_x) ** 2)


def count_turns(path, start):
    """Angle of the head over whole turns at the start of each piece.

    path: truth.path.Path that keeps away from the z axis.  start: angle
    before it.  Each piece is straight: it sweeps less than half a turn.
    """
    s = path.distance_in_piece(np.arange(len(path.t0)), path.duration)
    x0, y0 = path.x, path.y
    x1, y1 = x0 + path.rx * s, y0 + path.ry * s
    sweeps = np.arctan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)
    return start + np.concatenate([[0.], np.cumsum(sweeps)])[:-1]


def bed_angle(path, t, start):
    """Angle of the head at times t (n,), counted on from `start`."""
    begins = count_turns(path, start)
    index, _ = path._locate(t)
    p, x0, y0 = path.xyz(t), path.x[index], path.y[index]
    return begins[index] + np.arctan2(x0 * p[:, 1] - y0 * p[:, 0],
                                      x0 * p[:, 0] + y0 * p[:, 1])
