# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact positions along a planned path, evaluated the slow and plain way.

A path is a table of pieces of constant acceleration along straight lines or
arcs, ordered in time.  Between pieces the machine rests.  Nothing here knows the
program under test: the pieces come from `truth.plan`.
"""

import numpy as np

PIECE_FIELDS = ("t0", "duration", "v0", "accel", "x", "y", "z", "rx", "ry", "rz",
                "e", "re", "advance")
# Of arcs: the axis they turn around (0, 1, 2), middle and radius in the plane of
# the next two axes, angle at the start of the piece and rad a mm of the way
ARC_FIELDS = ("normal", "middle_a", "middle_b", "radius", "angle", "rate")
NO_ARC = (0.,) * len(ARC_FIELDS)
GAUSS = 1.0 / np.sqrt(3.0)
BATCH = 200000


class Path:
    """Pieces of a plan as arrays, shape (n,) each; mm, s."""

    # Gauss's rule for averages, (node, weight): exact for cubics
    RULE = ((-GAUSS, 1.), (GAUSS, 1.))

    def __init__(self, pieces):
        fields = PIECE_FIELDS + ARC_FIELDS
        pieces = [row if len(row) == len(fields) else (*row, *NO_ARC)
                  for row in pieces]
        table = np.array(pieces, dtype=np.float64).reshape(-1, len(fields))
        for i, name in enumerate(fields):
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
        return self.find_places(index, self.distance_in_piece(index, local))

    def find_places(self, index, s):
        """Positions (n, 3), s mm (n,) after the starts of pieces."""
        points = np.stack([self.x[index] + self.rx[index] * s,
                           self.y[index] + self.ry[index] * s,
                           self.z[index] + self.rz[index] * s], axis=1)
        for normal in range(3):
            on = np.nonzero((self.rate[index] != 0.)
                            & (self.normal[index] == normal))[0]
            which = index[on]
            angle = self.angle[which] + self.rate[which] * s[on]
            points[on, (normal + 1) % 3] = (self.middle_a[which]
                                            + self.radius[which] * np.cos(angle))
            points[on, (normal + 2) % 3] = (self.middle_b[which]
                                            + self.radius[which] * np.sin(angle))
        return points

    def extruder(self, t, advance=0.0, smooth_time=0.0):
        """Filament position (n,) with smoothed linear pressure advance.

        The lead is advance * the piece's own `advance` * speed.
        """
        t = np.asarray(t, dtype=np.float64)
        if not advance or not smooth_time:
            return self._filament(t, 0.0)
        return np.concatenate(
            [np.zeros(0)] + [self._smoothed(t[i:i + BATCH], advance, 0.5 * smooth_time)
                             for i in range(0, len(t), BATCH)])

    def _filament(self, t, advance):
        index, local = self._locate(t)
        s = self.distance_in_piece(index, local)
        inside = (t >= self.t0[index]) & (t <= self.t1[index])
        velocity = np.where(inside, self.v0[index] + self.accel[index] * local, 0.0)
        lead = advance * self.advance[index] * velocity
        return self.e[index] + self.re[index] * (s + lead)

    def _smoothed(self, t, advance, half):
        """Weighted mean over [t-half, t+half], weight falling linearly to 0.

        Both halves of the window are cut at the borders of pieces.  In each cut
        the integrand is a cubic at most, which two Gauss points integrate
        without error.  Means are of the difference to the position at t.
        """
        borders = np.unique(np.concatenate([self.t0, self.t1]))
        middle = self._filament(t, 0.0)
        total = np.zeros(len(t))
        for low, high in ((t - half, t), (t, t + half)):
            first = np.searchsorted(borders, low, side="right")
            count = np.searchsorted(borders, high, side="left") - first + 1
            owner = np.repeat(np.arange(len(t)), count)
            number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
            after = np.clip(first[owner] + number, 0, len(borders) - 1)
            before = np.clip(first[owner] + number - 1, 0, len(borders) - 1)
            left = np.where(number == 0, low[owner], borders[before])
            right = np.where(number == count[owner] - 1, high[owner], borders[after])
            centre, width = 0.5 * (left + right), 0.5 * (right - left)
            for node, share in self.RULE:
                x = centre + node * width
                weight = share * width * (half - np.abs(x - t[owner]))
                value = self._filament(x, advance) - middle[owner]
                total += np.bincount(owner, weight * value, len(t))
        return middle + total / (half * half)
