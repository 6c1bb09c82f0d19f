# SPDX-License-Identifier: GPL-3.0-or-later
"""What shaped steps leave of a resonator's vibration, against theory."""

import numpy as np
import pytest
from shaper_resonator import measure
from truth import shaping

FREQ = 45.
AT = FREQ * np.linspace(0.5, 1.6, 23)
# Most that is left at the frequency, and within so many % of it
QUALITY = {"zv": (0.004, 0), "mzv": (0.02, 4), "zvd": (0.004, 10), "ei": (0.055, 14),
           "2hump_ei": (0.055, 28), "3hump_ei": (0.055, 35), "smooth_zv": (0.004, 0),
           "smooth_mzv": (0.02, 4), "smooth_ei": (0.06, 15),
           "smooth_2hump_ei": (0.08, 25), "smooth_si": (0.09, 30)}


def theory(name, damping, at):
    """Left at the same time: later impulses had less time to fade."""
    last = (shaping.kernel(name, FREQ, damping)[1] if name in shaping.KERNELS
            else shaping.impulses(name, FREQ, damping)[1][-1])
    return (shaping.vibration(name, FREQ, damping, at)
            * np.exp(2 * np.pi * np.asarray(at) * damping * last))


@pytest.mark.parametrize("damping", [0., 0.1])
@pytest.mark.parametrize("name", shaping.NAMES)
def test_residual_vibration(name, damping):
    measured = measure(name, FREQ, damping, AT)
    assert np.abs(measured - theory(name, damping, AT)).max() < 0.01


@pytest.mark.parametrize("name", shaping.NAMES)
def test_what_each_is_made_for(name):
    centre, width = QUALITY[name]
    assert measure(name, FREQ, 0., [FREQ])[0] < centre
    band = FREQ * np.linspace(1. - width / 100, 1. + width / 100, 9)
    assert measure(name, FREQ, 0., band).max() < max(centre, 0.1)
