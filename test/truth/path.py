# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact positions along a planned path, evaluated the slow and plain way.

A path is a table of pieces of constant acceleration along straight lines,
ordered in time.  Between pieces the machine rests.  Nothing here knows the
program under test: the pieces come from `truth.plan`.
"""

import numpy as np

PIECE_FIELDS = ("t0", "duration", "v0", "accel", "x", "y", "z", "rx", "ry", "rz",
                "e", "re", "advance")


class Path:
    """Pieces of a plan as arrays, shape (n,) each; mm, s."""

    def __init__(self, pieces):
        table = np.array(pieces, dtype=np.float64).reshape(-1, len(PIECE_FIELDS))
        for i, name in enumerate(PIECE_FIELDS):
            setattr(self, name, table[:, i].copy())
        self.t1 = self.t0 + self.duration

    def _locate(self, t):
        """Index of the piece at (or last before) each time, and the time in it."""
        index = np.searchsorted(self.t0, t, side="right") - 1
        index = np.clip(index, 0, len(self.t0) - 1)
        local = np.clip(t - self.t0[index], 0.0, self.duration[index])
        return index, local

    def distance_in_piece(self, index, local):
        return (self.v0[index] + 0.5 * self.accel[index] * local) * local

    def xyz(self, t):
        """Positions (n, 3) at times t (n,)."""
        index, local = self._locate(np.asarray(t, dtype=np.float64))
        s = self.distance_in_piece(index, local)
        return np.stack([self.x[index] + self.rx[index] * s,
                         self.y[index] + self.ry[index] * s,
                         self.z[index] + self.rz[index] * s], axis=1)

    def extruder(self, t, advance=0.0, smooth_time=0.0):
        """Filament position (n,) with smoothed linear pressure advance."""
        t = np.asarray(t, dtype=np.float64)
        if not advance or not smooth_time:
            return self._extruder_raw(t, 0.0)
        return np.array([self._smoothed(x, advance, 0.5 * smooth_time) for x in t])

    def _extruder_raw(self, t, advance):
        index, local = self._locate(t)
        s = self.distance_in_piece(index, local)
        inside = (t >= self.t0[index]) & (t <= self.t1[index])
        velocity = np.where(inside, self.v0[index] + self.accel[index] * local, 0.0)
        lead = advance * self.advance[index] * velocity
        return self.e[index] + self.re[index] * (s + lead)

    def _smoothed(self, t, advance, half):
        """Weighted mean over [t-half, t+half], weight falling linearly to 0.

        On each piece the integrand is a cubic at most, so two Gauss points
        integrate it without error.
        """
        first = np.searchsorted(self.t1, t - half, side="right")
        last = np.searchsorted(self.t0, t + half, side="left")
        edges = np.concatenate([[t - half, t, t + half], self.t0[first:last],
                                self.t1[first:last]])
        edges = np.unique(edges[(edges >= t - half) & (edges <= t + half)])
        mid = 0.5 * (edges[1:] + edges[:-1])
        width = 0.5 * (edges[1:] - edges[:-1])
        index, _ = self._locate(mid)
        at_rest = (mid < self.t0[index]) | (mid > self.t1[index])
        total = 0.0
        for node in (-1.0 / np.sqrt(3.0), 1.0 / np.sqrt(3.0)):
            x = mid + node * width
            local = np.clip(x - self.t0[index], 0.0, self.duration[index])
            s = self.distance_in_piece(index, local)
            velocity = np.where(at_rest, 0.0, self.v0[index] + self.accel[index] * local)
            value = self.e[index] + self.re[index] * (
                s + advance * self.advance[index] * velocity)
            weight = (half - np.abs(x - t)) / (half * half)
            total += float(np.sum(width * weight * (value - self.e[index[0]])))
        return total + float(self.e[index[0]])
