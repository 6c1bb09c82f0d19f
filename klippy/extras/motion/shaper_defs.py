# SPDX-License-Identifier: GPL-3.0-or-later
"""Impulses of the input shapers that have some, by name.

A shaper is weights (their sum is 1) of what was planned so many s ago.  See
docs/input_shaping.md for the formulas and where they come from.
"""

import math
from collections import namedtuple

# Residual vibration that the EI shapers allow at their frequency
TOLERATED = 0.05
# Half a period of the damped resonance: the place of most impulses
HALF_PERIOD = 0.5
# MZV is spread over three quarters of a period
MZV_STEP = 0.375


class Shaper(namedtuple("Shaper", ("weights", "delays"))):
    """Weights and delays (s) of impulses; the mean of the delays is 0."""
    __slots__ = ()


class Family(namedtuple("Family", (
        "calc",
        "step",                 # between impulses, periods
        "max_damping"))):
    """calc(decay a step, share of tolerated vibration) -> raw weights."""
    __slots__ = ()


def _zv(k, v):
    return 1., k


def _zvd(k, v):
    return 1., 2. * k, k * k


def _mzv(k, v):
    side = 1. - math.sqrt(0.5)
    return side, (math.sqrt(2.) - 1.) * k, side * k * k


def _ei(k, v):
    return 0.25 * (1. + v), 0.5 * (1. - v) * k, 0.25 * (1. + v) * k * k


def _two_humps(k, v):
    x = (v * v * (math.sqrt(1. - v * v) + 1.)) ** (1. / 3.)
    first = (3. * x * x + 2. * x + 3. * v * v) / (16. * x)
    return tuple(w * k ** i for i, w in enumerate(
        (first, 0.5 - first, 0.5 - first, first)))


def _three_humps(k, v):
    first = 0.0625 * (1. + 3. * v + 2. * math.sqrt(2. * v * (v + 1.)))
    second = 0.25 * (1. - v)
    middle = 0.5 * (1. + v) - 2. * first
    return tuple(w * k ** i for i, w in enumerate(
        (first, second, middle, second, first)))


FAMILIES = {
    "zv": Family(_zv, HALF_PERIOD, 0.99),
    "mzv": Family(_mzv, MZV_STEP, 0.99),
    "zvd": Family(_zvd, HALF_PERIOD, 0.99),
    "ei": Family(_ei, HALF_PERIOD, 0.4),
    "2hump_ei": Family(_two_humps, HALF_PERIOD, 0.3),
    "3hump_ei": Family(_three_humps, HALF_PERIOD, 0.2),
}


def make_shaper(name, freq, damping_ratio):
    """The Shaper of a name in FAMILIES for a resonance of freq Hz (above 0)."""
    family = FAMILIES[name]
    root = math.sqrt(1. - damping_ratio * damping_ratio)
    step = family.step / (freq * root)
    decay = math.exp(-2. * math.pi * family.step * damping_ratio / root)
    raw = family.calc(decay, TOLERATED)
    total = sum(raw)
    weights = tuple(w / total for w in raw)
    centre = sum(w * i for i, w in enumerate(weights))
    return Shaper(weights, tuple((i - centre) * step for i in range(len(raw))))
