# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs of random moves within a box: everything that a planner finds hard."""

import numpy as np


def make_job(rng, count, low, high):
    """(positions, speeds): count + 1 rows x, y, z, e, and count speeds (mm/s).

    Runs of one direction, zigzags and exact reversals, ways from 0.01 mm to
    100 mm, hops of z, retractions and moves to nowhere.
    """
    low, high = np.asarray(low), np.asarray(high)
    runs = rng.integers(1, 20, count)
    turns = np.repeat(rng.uniform(0., 2. * np.pi, count), runs)[:count]
    style = np.repeat(rng.integers(0, 4, count), runs)[:count]
    turns += np.where(style == 1, rng.normal(0., 0.05, count), 0.)
    turns += np.where(style == 2, np.pi * (np.arange(count) % 2), 0.)
    turns = np.where(style == 3, rng.integers(0, 4, count) * 0.5 * np.pi, turns)
    scale = np.repeat(10. ** rng.uniform(-2., 2., count), runs)[:count]
    length = scale * rng.choice([1., 1., 0.5, 2.], count)
    steps = np.stack((length * np.cos(turns), length * np.sin(turns),
                      np.where(rng.random(count) < 0.06,
                               rng.normal(0., 1., count), 0.)), axis=1)
    steps[rng.random(count) < 0.03, :2] = 0.
    where = fold(np.cumsum(np.vstack((rng.uniform(low, high), steps)), axis=0),
                 low, high)
    where = np.round(where, 5)
    filament = np.concatenate(([0.], np.cumsum(find_filament(rng, where, runs))))
    speeds = np.repeat(10. ** rng.uniform(0., 2.7, count), runs)[:count]
    return (np.column_stack((where, np.round(filament, 5))), speeds)


def fold(points, low, high):
    """Reflect what is outside of the box into it."""
    width = high - low
    return low + width - np.abs((points - low) % (2. * width) - width)


def find_filament(rng, where, runs):
    """Ways of the filament: travel, lines, retractions."""
    count = len(where) - 1
    way = np.sqrt((np.diff(where, axis=0) ** 2).sum(axis=1))
    pace = np.repeat(rng.choice([0., 0.02, 0.033, 0.1], count), runs)[:count]
    filament = pace * way
    wiped = rng.random(count) < 0.02
    filament[wiped] = -0.02 * way[wiped]
    still = way == 0.
    filament[still] = rng.choice([-0.8, 0.8, 0.], still.sum())
    return filament
