# SPDX-License-Identifier: GPL-3.0-or-later
"""A mass on a spring, dragged along by the steps of a shaped motor."""

import numpy as np
from motion_rig import Rig, make_move

from klippy.extras import shaper_defs, shaper_kernels
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.shaper import ShapedPath

STEP = 1 / 1280
TICKS = 180e6


def make_steps(name, freq, damping):
    """(times, directions) of a short fast move; name None: not shaped."""
    kin = LinearKinematics(1., 0., 0.)
    rig = Rig([kin], STEP, freq=TICKS, max_error=2e-6)
    if name is not None:
        path = ShapedPath()
        if name in shaper_defs.FAMILIES:
            path.set_impulses(0, *shaper_defs.make_shaper(name, freq, damping))
        else:
            path.set_kernel(0, *shaper_kernels.make_kernel(name, freq, damping))
        kin.set_shaper(path)
    rig.add(1., make_move(.002, .001, .002, rig.start, (1., 0., 0.), 0., 400., 2e5))
    rig.run(2.)
    clocks, directions = rig.steps()
    return clocks / TICKS, directions


def swing(times, directions, freq, damping):
    """Amplitude (mm) to which a resonator of freq (n,) Hz swings at 1.2 s.

    Between steps, which jump, it moves as x'' + 2 d w x' + w^2 x = 0 does.
    """
    omega = 2 * np.pi * np.asarray(freq)
    rate = omega * (-damping + 1j * np.sqrt(1 - damping ** 2))
    state, last = np.zeros(len(omega), dtype=complex), times[0]
    for time, direction in zip(times, directions, strict=True):
        state = state * np.exp(rate * (time - last)) - direction * STEP
        last = time
    return np.abs(state * np.exp(rate * (1.2 - last)))


def measure(name, freq, damping, at):
    """Share of the vibration that the shaper leaves, at frequencies (n,)."""
    return (swing(*make_steps(name, freq, damping), at, damping)
            / swing(*make_steps(None, freq, damping), at, damping))
