# SPDX-License-Identifier: GPL-3.0-or-later
"""Filament positions by the curved models of pressure advance, the slow way."""

import numpy as np

SHAPES = {"linear": lambda x: 0. * x, "tanh": np.tanh,
          "recipr": lambda x: 1. - 1. / (1. + x)}


def position(path, t, advance=0., smooth_time=0., model="linear", offset=0.,
             velocity=1., time_offset=0.):
    """Filament position (n,) mm at times t (n,) s of the drive; see truth.path.

    The curved part is that of the averaged velocity of what is led.
    """
    t = np.asarray(t, dtype=np.float64) + time_offset
    if not smooth_time or not (advance or offset):
        return path.extruder(t)
    plain = path.extruder(t, 1e-30, smooth_time)
    # the average is linear: what one second of advance adds is the velocity
    speed = path.extruder(t, 1., smooth_time) - plain
    return (plain + advance * speed
            + offset * SHAPES[model](np.maximum(speed, 0.) / velocity))
