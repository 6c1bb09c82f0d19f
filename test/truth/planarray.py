# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules of the motion page for very many moves at once, as arrays.

A third reading of docs/internals/motion.md, by numpy: one row a move.  Each
job begins and ends at rest.  Units: mm, s.
"""

import numpy as np

SHORTEST_WAY = 1e-9
STRAIGHT = 1e-6
# A junction that is a valley by less than this may be judged either way
VALLEY = 1e-6
UNSURE = 1e-8


def make_rows(start, end, speed, limits):
    """What each move is allowed, before the machine's own limits.

    start, end: (n, 4) arrays; speed: (n,); limits: truth.gcode.Limits.
    """
    ways = end - start
    d = np.sqrt((ways[:, :3] ** 2).sum(axis=1))
    alone = d < SHORTEST_WAY
    ways[alone, :3] = 0.
    d = np.where(alone, np.abs(ways[:, 3]), d)
    unit = ways / d[:, None]
    rows = {"d": d, "alone": alone, "unit": unit, "start": start, "end": end,
            "v": np.where(alone, speed, np.minimum(speed, limits.max_velocity)),
            "a": np.where(alone, 1e8, limits.max_accel)}
    rows["g"] = rows["a"] * np.where(alone, 1., 1. - limits.cruise_ratio)
    z = np.abs(unit[:, 2])
    slow_down(rows, z > 0., limits.max_z_velocity / positive(z),
              limits.max_z_accel / positive(z))
    e = np.abs(unit[:, 3])
    at_rest = (ways[:, 0] == 0.) & (ways[:, 1] == 0.)
    slow_down(rows, (e > 0.) & (at_rest | (unit[:, 3] < 0.)),
              limits.filament_velocity / positive(e),
              limits.filament_accel / positive(e))
    return rows


def positive(values):
    """values, but 1 where they are 0 (and not asked for)."""
    return np.where(values > 0., values, 1.)


def slow_down(rows, where, v, a):
    """Limit speed and acceleration of some of the moves."""
    rows["v"] = np.where(where, np.minimum(rows["v"], v), rows["v"])
    rows["a"] = np.where(where, np.minimum(rows["a"], a), rows["a"])


def find_junctions(rows, limits):
    """Greatest v2 at the n + 1 ends of the moves of a job."""
    unit, v2, a, d = rows["unit"], rows["v"] ** 2, rows["a"], rows["d"]
    cosine = (unit[:-1, :3] * unit[1:, :3]).sum(axis=1)
    # Of half the angle: sine 1 for straight on, 0 for back
    sin_half = np.sqrt(np.clip(0.5 * (1. + cosine), 0., 1.))
    cos_half = np.sqrt(np.clip(0.5 * (1. - cosine), 0., 1.))
    jd = limits.corner_velocity ** 2 * (np.sqrt(2.) - 1.) / limits.max_accel
    least = np.minimum(v2[:-1], v2[1:])
    bent = (cos_half > STRAIGHT) & (sin_half < 1.)
    reach = sin_half / np.where(bent, 1. - sin_half, 1.)
    arc = 0.5 * sin_half / np.where(bent, cos_half, 1.)
    for part in (slice(None, -1), slice(1, None)):
        corner = np.minimum(reach * jd * a[part], arc * d[part] * a[part])
        least = np.where(bent, np.minimum(least, corner), least)
    change = np.abs(np.diff(unit[:, 3]))
    pace = (limits.filament_jump / positive(change)) ** 2
    least = np.where(change > 0., np.minimum(least, pace), least)
    least[rows["alone"][:-1] | rows["alone"][1:]] = 0.
    return np.concatenate(([0.], least, [0.]))


def find_greatest(junctions, change):
    """Greatest v2 at each end that changes by no more than `change` a move."""
    reached = np.concatenate(([0.], np.cumsum(change)))
    back = np.minimum.accumulate((junctions + reached)[::-1])[::-1] - reached
    return np.minimum.accumulate(back - reached) + reached


def find_tops(calm, tops, margin):
    """Greatest of the tops of each hill, for each move."""
    inner, left, right = calm[1:-1], tops[:-1], tops[1:]
    is_valley = (left - inner > margin * left) & (right - inner > margin * right)
    firsts = np.concatenate(([0], np.flatnonzero(is_valley) + 1))
    counts = np.diff(np.concatenate((firsts, [len(tops)])))
    return np.repeat(np.maximum.reduceat(tops, firsts), counts)


def plan(rows, limits):
    """Squares of speeds: (least, greatest), each (start, cruise, end) arrays.

    They differ only where rounding decides what is a valley.
    """
    v2, wide = rows["v"] ** 2, 2. * rows["d"] * rows["a"]
    gentle = np.minimum(2. * rows["d"] * rows["g"], wide)
    junctions = find_junctions(rows, limits)
    full = find_greatest(junctions, wide)
    calm = find_greatest(junctions, gentle)
    tops = np.minimum(v2, 0.5 * (calm[:-1] + calm[1:] + gentle))
    bounds = []
    for margin in (VALLEY - UNSURE, VALLEY + UNSURE):
        cap = np.minimum(v2, find_tops(calm, tops, margin))
        start, end = np.minimum(full[:-1], cap), np.minimum(full[1:], cap)
        bounds.append((start, np.minimum(cap, 0.5 * (start + end + wide)), end))
    return bounds
