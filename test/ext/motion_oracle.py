# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of steps the plain way: each as long as any can be, found by bisection."""

import numpy as np

ADD_MIN, ADD_MAX, COUNT_MAX = -0x8000, 0x7fff, 0xffff


def make_windows(clocks, start, max_error):
    """(low, high) clocks a step may have; neighbours never overlap."""
    gaps = np.diff(np.concatenate([[start], clocks]))
    room = (np.minimum(gaps, np.append(gaps[1:], gaps[-1])) - 1) // 2
    error = np.minimum(room, max_error)
    return clocks - error, clocks + error


def interval_range(low, high, add):
    """Least and greatest interval that meets all windows with this add."""
    k = np.arange(1, len(low) + 1)
    bend = add * (k * (k - 1) // 2)
    return int((-((bend - low) // k)).max()), int(((high - bend) // k).min())


def find_curve(low, high):
    """(interval, add) of a run through all windows, or None.

    The width of the range of intervals is concave in add, and so has one top.
    """
    left, right = ADD_MIN, ADD_MAX
    while right - left > 2:
        mid = (left + right) // 2
        widths = []
        for add in (mid, mid + 1):
            least, greatest = interval_range(low, high, add)
            widths.append(greatest - least)
        if max(widths) >= 0:
            left = right = mid if widths[0] >= widths[1] else mid + 1
        elif widths[0] == widths[1]:
            return None
        elif widths[0] > widths[1]:
            right = mid
        else:
            left = mid + 1
    for add in range(left, right + 1):
        least, greatest = interval_range(low, high, add)
        if least <= greatest:
            return (least + greatest) // 2, add
    return None


def find_runs(clocks, start, max_error):
    """[(interval, count, add)], each the longest that its start allows."""
    low, high = make_windows(clocks, start, max_error)
    runs, first = [], 0
    while first < len(clocks):
        left = len(clocks) - first

        def try_length(n, first=first, start=start):
            part = slice(first, first + n)
            return find_curve(low[part] - start, high[part] - start)
        good, bad, curve = 0, 1, None
        while bad <= min(left, COUNT_MAX) and (found := try_length(bad)):
            good, bad, curve = bad, bad * 2, found
        bad = min(bad, left + 1, COUNT_MAX + 1)
        while bad - good > 1:
            n = (good + bad) // 2
            if found := try_length(n):
                good, curve = n, found
            else:
                bad = n
        interval, add = curve
        runs.append((interval, good, add))
        start += interval * good + add * (good * (good - 1) // 2)
        first += good
    return runs
