# SPDX-License-Identifier: GPL-3.0-or-later
"""Judge recorded steps against exact positions.

A step from n to n+-1 must happen when the exact stepper position crosses the
half-step level between the two, give or take the compression tolerance.  It
did if the exact position straddles that level between `time - tolerance` and
`time + tolerance`.  Where the motion turns back just beyond a level that is
looked for within this window.
"""

import numpy as np

TOLERANCE = 25e-6       # s, bound of step compression
ROUNDING = 2e-9         # mm, double arithmetic on both sides
MAX_TURNS = 1000        # so many steps at most are looked at more closely
TURN_SAMPLES = 2001


def check_steps(times, directions, start_steps, position, step_dist, tick,
                tolerance=TOLERANCE):
    """Return the indexes of steps outside the bound, and the final count.

    times: (n,) s.  directions: (n,) +-1.  start_steps: count before the first.
    position: function of times (m,) giving the exact position (m,) in mm.
    """
    times = np.asarray(times, dtype=np.float64)
    directions = np.asarray(directions, dtype=np.int64)
    count_after = start_steps + np.cumsum(directions)
    level = (count_after - 0.5 * directions) * step_dist
    bound = tolerance + tick
    before = (position(times - bound) - level) * directions
    after = (position(times + bound) - level) * directions
    bad = np.nonzero((before > ROUNDING) | (after < -ROUNDING))[0]
    if len(bad) <= MAX_TURNS:
        bad = np.array([i for i in bad if not crosses_at_turn(
            times[i], directions[i], level[i], position, bound)], dtype=np.int64)
    final = int(count_after[-1]) if len(times) else start_steps
    return bad, final


def crosses_at_turn(time, direction, level, position, bound):
    """True if the position gets past the level within the window after all."""
    at = np.linspace(time - bound, time + bound, TURN_SAMPLES)
    # a corner may be sharp: look closer where it turns
    past = (position(at) - level) * direction
    near = [at[[max(i - 1, 0), min(i + 1, TURN_SAMPLES - 1)]]
            for i in (np.argmin(past), np.argmax(past))]
    at = np.sort(np.concatenate([at, *(np.linspace(*ends, TURN_SAMPLES)
                                       for ends in near)]))
    past = (position(at) - level) * direction
    short_of_it = np.minimum.accumulate(past) <= ROUNDING
    return bool(np.any(short_of_it & (past >= -ROUNDING)))


def check_counts(times, directions, start_steps, position, step_dist, bound, at):
    """Indexes of moments `at` (m,) s at which the count is not what it must be.

    A count is right if it is the exact position, rounded, at some moment not
    further off than the bound (s).  Finds steps that are missing altogether.
    """
    counts = np.concatenate([[0], np.cumsum(directions)]) + start_steps
    count = counts[np.searchsorted(times, at, side="right")]
    near = np.stack([position(at - bound), position(at), position(at + bound)])
    slack = 0.5 + 2.0 * ROUNDING / step_dist
    low, high = near.min(axis=0) / step_dist, near.max(axis=0) / step_dist
    return np.nonzero((count < low - slack) | (count > high + slack))[0]


def worst_error(times, directions, start_steps, position, step_dist, index):
    """Signed time (s) from step `index` to its exact crossing, by bisection."""
    count = start_steps + int(np.sum(directions[:index + 1]))
    level = (count - 0.5 * directions[index]) * step_dist
    reach = 1e-3
    low, high = times[index] - reach, times[index] + reach
    for _ in range(60):
        mid = 0.5 * (low + high)
        value = (position(np.array([mid]))[0] - level) * directions[index]
        low, high = (mid, high) if value < 0.0 else (low, mid)
    return times[index] - 0.5 * (low + high)
