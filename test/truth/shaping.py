# SPDX-License-Identifier: GPL-3.0-or-later
"""Input shapers by their published formulas, and paths shaped by them, slowly.

Impulses: Singer & Seering 1990 (zv, zvd), Singhose et al. 1997 (ei and its
multi-hump forms, 5 % tolerated), mzv with three impulses 3/8 of a period apart.
Kernels: the design of docs/input_shaping.md, solved by Gauss and numpy.
"""

import numpy as np
from numpy.polynomial import legendre, polynomial

from truth.path import PIECE_FIELDS, Path

TOLERATED = 0.05
# width (periods), band, number of free coefficients, roughness
KERNELS = {"smooth_zv": (0.85, 0., 5, 1e-4), "smooth_mzv": (0.96, 0.10, 7, 1e-4),
           "smooth_ei": (1.2, 0.18, 7, 1e-4), "smooth_2hump_ei": (1.4, 0.30, 9, 5e-5),
           "smooth_si": (1.6, 0.40, 9, 5e-5)}
IMPULSES = ("zv", "mzv", "zvd", "ei", "2hump_ei", "3hump_ei")
NAMES = (*IMPULSES, *KERNELS)
NODES, NODE_WEIGHTS = legendre.leggauss(10)
FINE, FINE_WEIGHTS = legendre.leggauss(60)


def undamped(name):
    """Amplitudes by impulse, and their distance in periods."""
    v = TOLERATED
    if name == "zv":
        return np.array([.5, .5]), .5
    if name == "zvd":
        return np.array([.25, .5, .25]), .5
    if name == "mzv":
        side = 1 - 1 / np.sqrt(2)
        return np.array([side, 1 - 2 * side, side]), .375
    if name == "ei":
        return np.array([(1 + v) / 4, (1 - v) / 2, (1 + v) / 4]), .5
    if name == "2hump_ei":
        x = np.cbrt(v ** 2 * (np.sqrt(1 - v ** 2) + 1))
        a = (3 * x ** 2 + 2 * x + 3 * v ** 2) / (16 * x)
        return np.array([a, .5 - a, .5 - a, a]), .5
    a = (1 + 3 * v + 2 * np.sqrt(2 * (v ** 2 + v))) / 16
    b = (1 - v) / 4
    return np.array([a, b, 1 - 2 * (a + b), b, a]), .5


def impulses(name, freq, damping):
    """(weights, delays) around their mean; s."""
    amplitudes, distance = undamped(name)
    if name == "mzv":       # by the ratio of its impulses without damping
        amplitudes = np.array([1 - 1 / np.sqrt(2), np.sqrt(2) - 1,
                               1 - 1 / np.sqrt(2)])
    omega = 2 * np.pi * freq
    times = np.arange(len(amplitudes)) * distance / (
        freq * np.sqrt(1 - damping ** 2))
    weights = amplitudes * np.exp(-damping * omega * times)
    weights /= weights.sum()
    return weights, times - weights @ times


def kernel(name, freq, damping):
    """(coefficients of w(u) by power of u, half width in s)."""
    width, band, n, roughness = KERNELS[name]
    basis = np.array([np.convolve([1, 0, -1], np.eye(n)[k]) for k in range(n)])
    values = np.array([polynomial.polyval(FINE, b) for b in basis])
    slopes = np.array([polynomial.polyval(FINE, polynomial.polyder(b)) for b in basis])
    cost = roughness * (slopes * FINE_WEIGHTS) @ slopes.T

    def respond(ratio):
        rate = np.pi * width * ratio * (damping - 1j * np.sqrt(1 - damping ** 2))
        return values @ (FINE_WEIGHTS * np.exp(rate * FINE))
    limits = [values @ FINE_WEIGHTS, values @ (FINE_WEIGHTS * FINE)]
    if band:
        rows = np.array([respond(1 + band * x) for x in np.linspace(-1, 1, 9)])
        cost = cost + (rows.T @ rows.conj()).real / 9
    else:
        limits += [respond(1.).real, respond(1.).imag]
    limits = np.array(limits)
    zero = np.zeros((len(limits), len(limits)))
    answer = np.linalg.solve(np.block([[cost, limits.T], [limits, zero]]),
                             np.concatenate([np.zeros(n), [1.], np.zeros(
                                 len(limits) - 1)]))
    return answer[:n] @ basis, .5 * width / freq


def vibration(name, freq, damping, at):
    """Share of a step's vibration left in a resonance of `at` Hz (n,)."""
    omega = 2 * np.pi * np.asarray(at)[:, None]
    if name in KERNELS:
        coeffs, half = kernel(name, freq, damping)
        delays = FINE * half
        weights = FINE_WEIGHTS * polynomial.polyval(FINE, coeffs)
        last = half
    else:
        weights, delays = impulses(name, freq, damping)
        last = delays[-1]
    terms = weights * np.exp((damping - 1j * np.sqrt(1 - damping ** 2))
                             * omega * delays)
    return np.abs(terms.sum(axis=1)) * np.exp(-damping * omega[:, 0] * last)


class ShapedPath(Path):
    """A path whose axes are averaged."""

    def __init__(self, pieces, axes):
        """axes: {0..2: (name, freq, damping)}."""
        super().__init__(pieces)
        self.filament = None
        self.shapers = {axis: (kernel if s[0] in KERNELS else impulses)(*s)
                        + (s[0] in KERNELS,) for axis, s in axes.items()}

    def xyz(self, t):
        t = np.asarray(t, dtype=np.float64)
        result = super().xyz(t)
        for axis, (shape, times, is_kernel) in self.shapers.items():
            result[:, axis] = (self._smooth(t, axis, shape, times) if is_kernel else
                               sum(w * super(ShapedPath, self).xyz(t - d)[:, axis]
                                   for w, d in zip(shape, times, strict=True)))
        return result

    def extruder(self, t, advance=0., smooth_time=0.):
        if self.filament is None:
            return super().extruder(t, advance, smooth_time)
        return self.filament.extruder(t, advance, smooth_time)

    def _smooth(self, t, axis, coeffs, half):
        """Gauss's rule between the borders of pieces, exact for polynomials."""
        borders = np.unique(np.concatenate([self.t0, self.t1]))
        middle = super().xyz(t)[:, axis]
        total = np.zeros(len(t))
        first = np.searchsorted(borders, t - half, side="right")
        count = np.searchsorted(borders, t + half, side="left") - first + 1
        owner = np.repeat(np.arange(len(t)), count)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        index = first[owner] + number
        left = np.where(number == 0, t[owner] - half,
                        borders[np.clip(index - 1, 0, len(borders) - 1)])
        right = np.where(number == count[owner] - 1, t[owner] + half,
                         borders[np.clip(index, 0, len(borders) - 1)])
        centre, width = .5 * (left + right), .5 * (right - left)
        for node, weight in zip(NODES, NODE_WEIGHTS, strict=True):
            at = centre + node * width
            share = polynomial.polyval((t[owner] - at) / half, coeffs)
            value = super().xyz(at)[:, axis] - middle[owner]
            total += np.bincount(owner, weight * width / half * share * value, len(t))
        return middle + total


class PartOfFilament(Path):
    """The filament of a path that is laid down by the ways along some axes.

    On an arc the square of an axis' share of the way changes with the angle.
    """

    def __init__(self, pieces, axes, is_rest=False):
        """is_rest: what the axes leave, and what is pushed without a way."""
        super().__init__(pieces)
        self.has_arcs = self.rate.any()
        if self.has_arcs:
            self.RULE = tuple(zip(*legendre.leggauss(5), strict=True))
        ratios = np.stack([self.rx, self.ry, self.rz])
        length2 = (ratios ** 2).sum(axis=0)
        self.squares = ratios ** 2 / np.where(length2 > 0., length2, 1.)
        self.axes, self.is_rest = axes, is_rest
        index = np.arange(len(self.t0))
        ways = self.re * self._sum_up(
            index, self.distance_in_piece(index, self.duration))
        self.e = np.cumsum(ways) - ways

    def _list_shares(self, index, s):
        """Of each axis: (share after s mm, its integral over the way)."""
        for axis in self.axes:
            share = self.squares[axis, index]
            so_far = share * s
            if self.has_arcs:
                self._bend(axis, index, s, share, so_far)
            yield share, so_far

    def _bend(self, axis, index, s, share, so_far):
        """Put what is true of arcs in place."""
        place = (axis - self.normal[index]) % 3
        on = np.nonzero((self.rate[index] != 0.) & (place != 0))[0]
        which = index[on]
        rate, first = self.rate[which], self.angle[which]
        last = first + rate * s[on]
        # where the axis is the first one of the plane the tangent's part of it
        # is the sine of the angle
        sign = np.where(place[on] == 1, -1., 1.)
        flat2 = (self.radius[which] * rate) ** 2
        share[on] = flat2 * 0.5 * (1. + sign * np.cos(2. * last))
        so_far[on] = flat2 * (0.5 * s[on] + sign * (
            np.sin(2. * last) - np.sin(2. * first)) / (4. * rate))

    def _share(self, index, s):
        share = sum(now for now, _ in self._list_shares(index, s))
        return 1. - share if self.is_rest else share

    def _sum_up(self, index, s):
        total = sum(so_far for _, so_far in self._list_shares(index, s))
        return s - total if self.is_rest else total

    def _filament(self, t, advance):
        index, local = self._locate(t)
        s = self.distance_in_piece(index, local)
        inside = (t >= self.t0[index]) & (t <= self.t1[index])
        velocity = np.where(inside, self.v0[index] + self.accel[index] * local, 0.)
        lead = advance * self.advance[index] * velocity * self._share(index, s)
        return self.e[index] + self.re[index] * (self._sum_up(index, s) + lead)


class ShapedFilament:
    """Filament that is laid down by shaped axes, the slow way.

    Each axis gets the part of a piece's filament that is the square of the axis'
    share of the way, as a path of its own, which is led, smoothed and averaged
    alone.  What is pushed at rest is averaged by nothing.
    """

    PANELS = 12

    def __init__(self, pieces, axes):
        """axes: as for ShapedPath."""
        self.base = pieces[0][PIECE_FIELDS.index("e")]
        self.parts = [(PartOfFilament(pieces, [axis]), setting)
                      for axis, setting in axes.items()]
        self.parts.append((PartOfFilament(pieces, list(axes), True), None))

    def extruder(self, t, advance=0., smooth_time=0.):
        """As that of Path."""
        t = np.asarray(t, dtype=np.float64)
        total = np.full(len(t), self.base)
        for path, setting in self.parts:
            def part(at, path=path):
                return path.extruder(at, advance, smooth_time)
            if setting is None:
                total += part(t)
            elif setting[0] in KERNELS:
                total += self._smooth(part, t, *kernel(*setting))
            else:
                total += sum(w * part(t - d) for w, d in zip(
                    *impulses(*setting), strict=True))
        return total

    def _smooth(self, part, t, coeffs, half):
        """Gauss's rule in panels; what is averaged is smooth enough for that."""
        total = np.zeros(len(t))
        width = 1. / self.PANELS
        for i in range(self.PANELS):
            centre = (2 * i + 1) * width - 1.
            for node, weight in zip(NODES, NODE_WEIGHTS, strict=True):
                u = centre + node * width
                total += (weight * width * polynomial.polyval(u, coeffs)
                          * part(t - u * half))
        return total


class Shaping:
    """The section [input_shaper] of a config, for the judge."""

    def __init__(self, section):
        self.axes = {}
        for axis, name in enumerate("xyz"):
            freq = float(section.get("shaper_freq_" + name, 0.))
            if freq:
                kind = section.get("shaper_type_" + name,
                                   section.get("shaper_type", "mzv"))
                self.axes[axis] = (kind, freq,
                                   float(section.get("damping_ratio_" + name, 0.1)))
        self.window = max(self._get_reach(s) for s in self.axes.values())
        self.is_filament_shaped = "enabled_extruders" in section

    @staticmethod
    def _get_reach(setting):
        if setting[0] in KERNELS:
            return kernel(*setting)[1]
        return np.abs(impulses(*setting)[1]).max()

    def make_path(self, rows):
        path = ShapedPath(rows, self.axes)
        if self.is_filament_shaped:
            path.filament = ShapedFilament(rows, self.axes)
        return path
