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
    before it.
    """
    sweeps = sweep(path, np.arange(len(path.t0)), path.duration)
    return start + np.concatenate([[0.], np.cumsum(sweeps)])[:-1]


def sweep(path, index, local):
    """By how much the head turned so long after the start of its piece.

    In parts, each of less than half a turn about the z axis.
    """
    total = np.zeros(len(index))
    for is_arc, parts in ((False, 1), (True, 8)):
        on = np.nonzero((path.rate[index] != 0.) == is_arc)[0]
        which, times = index[on], local[on]
        before = path.find_places(which, 0. * times)
        for part in range(1, parts + 1):
            now = path.find_places(
                which, path.distance_in_piece(which, times * part / parts))
            total[on] += np.arctan2(
                before[:, 0] * now[:, 1] - before[:, 1] * now[:, 0],
                before[:, 0] * now[:, 0] + before[:, 1] * now[:, 1])
            before = now
    return total


def bed_angle(path, t, start):
    """Angle of the head at times t (n,), counted on from `start`."""
    begins = count_turns(path, start)
    index, local = path._locate(t)
    plan = path.find_places(index, path.distance_in_piece(index, local))
    p = path.xyz(t)         # shaped, maybe
    off = np.arctan2(plan[:, 0] * p[:, 1] - plan[:, 1] * p[:, 0],
                     plan[:, 0] * p[:, 0] + plan[:, 1] * p[:, 1])
    return begins[index] + sweep(path, index, local) + off
