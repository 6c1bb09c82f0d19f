# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth input shapers: polynomial kernels, made for a frequency and damping.

A kernel is w(u) = sum of coeffs[k] * u^k for u = delay / half in [-1, 1].  It is
0 at both ends, its integral 1 and its centre at 0.  Of all polynomials of its
degree that cancel the resonance it is the one that vibrates least within a band
of frequencies and is smoothest.  See docs/input_shaping.md.
"""

import cmath
import functools
import math
from collections import namedtuple

# Nodes of Simpson's rule over the kernel: an even number of parts
PARTS = 600
# Frequencies looked at in a band
BAND_POINTS = 9


class Kernel(namedtuple("Kernel", ("coeffs", "half"))):
    """Coefficients by power of u, and half the width (s)."""
    __slots__ = ()


class Design(namedtuple("Design", (
        "width",                # periods of the resonance
        "band",                 # either side, share of the frequency
        "n_free",               # coefficients to choose
        "roughness"))):         # weight of the mean square of the slope
    """What a smooth shaper is made for."""
    __slots__ = ()


DESIGNS = {
    "smooth_zv": Design(0.85, 0., 5, 1e-4),
    "smooth_mzv": Design(0.96, 0.10, 7, 1e-4),
    "smooth_ei": Design(1.2, 0.18, 7, 1e-4),
    "smooth_2hump_ei": Design(1.4, 0.30, 9, 5e-5),
    "smooth_si": Design(1.6, 0.40, 9, 5e-5),
}
MAX_DAMPING = 0.5


def _solve(rows):
    """Solution of a square system whose rows end with the right side."""
    size = len(rows)
    for i in range(size):
        best = max(range(i, size), key=lambda k, i=i: abs(rows[k][i]))
        rows[i], rows[best] = rows[best], rows[i]
        for k in range(i + 1, size):
            share = rows[k][i] / rows[i][i]
            if share:
                rows[k] = [a - share * b
                           for a, b in zip(rows[k], rows[i], strict=True)]
    answer = [0.] * size
    for i in reversed(range(size)):
        known = sum(rows[i][k] * answer[k] for k in range(i + 1, size))
        answer[i] = (rows[i][-1] - known) / rows[i][i]
    return answer


def _integrate_power(power):
    """Integral of u^power from -1 to 1."""
    return 0. if power % 2 else 2. / (power + 1)


def _integrate_basis(k, power=0):
    """Integral of (1 - u^2) * u^k * u^power."""
    return _integrate_power(k + power) - _integrate_power(k + power + 2)


def _respond(n_free, rate):
    """Integrals of (1 - u^2) * u^k * exp(rate * u), for each k."""
    sums = [0j] * n_free
    for i in range(PARTS + 1):
        u = 2. * i / PARTS - 1.
        weight = (1. if i in (0, PARTS) else 4. if i % 2 else 2.) * 2. / (3. * PARTS)
        term = weight * (1. - u * u) * cmath.exp(rate * u)
        for k in range(n_free):
            sums[k] += term
            term *= u
    return sums


def _slope_product(i, k):
    """Integral of the product of the slopes of two basis functions."""
    def slope(n):
        return [(n, n - 1), (-(n + 2), n + 1)]
    return sum(a * b * _integrate_power(p + q) for a, p in slope(i)
               for b, q in slope(k) if a and b)


@functools.lru_cache(maxsize=16)
def make_kernel(name, freq, damping_ratio):
    """The Kernel of a name in DESIGNS for a resonance of freq Hz (above 0)."""
    design = DESIGNS[name]
    n = design.n_free
    root = math.sqrt(1. - damping_ratio * damping_ratio)
    rate = math.pi * design.width * complex(damping_ratio, -root)
    cost = [[design.roughness * _slope_product(i, k) for k in range(n)]
            for i in range(n)]
    for j in range(BAND_POINTS if design.band else 0):
        ratio = 1. + design.band * (2. * j / (BAND_POINTS - 1) - 1.)
        values = _respond(n, rate * ratio)
        for i in range(n):
            for k in range(n):
                cost[i][k] += (values[i] * values[k].conjugate()).real / BAND_POINTS
    centre = _respond(n, rate)
    limits = [([_integrate_basis(k) for k in range(n)], 1.),
              ([_integrate_basis(k, 1) for k in range(n)], 0.)]
    if not design.band:
        limits += [([c.real for c in centre], 0.), ([c.imag for c in centre], 0.)]
    rows = [cost[i] + [limit[i] for limit, _ in limits] + [0.] for i in range(n)]
    rows += [[*limit, *[0.] * len(limits), value] for limit, value in limits]
    free = _solve(rows)[:n]
    coeffs = [a - b for a, b in zip([*free, 0., 0.], [0., 0., *free], strict=True)]
    total = sum(c * _integrate_power(k) for k, c in enumerate(coeffs))
    return Kernel(tuple(c / total for c in coeffs), 0.5 * design.width / freq)
