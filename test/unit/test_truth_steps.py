# SPDX-License-Identifier: GPL-3.0-or-later
"""The judge of steps itself: what it calls right and wrong at a sharp corner."""

import numpy as np
import pytest
from truth.steps import check_steps

STEP, TICK = 0.0025, 5e-8
SPEED = 50.                 # mm/s, up to the corner and down from it


@pytest.mark.parametrize("corner", [7e-9, 1.3e-8, 0.])
@pytest.mark.parametrize("short, is_right", [(1e-12, True), (1e-6, False)])
def test_two_steps_where_a_corner_just_reaches_them(corner, short, is_right):
    """A step up and one down at once are right if the corner comes to the level,
    and not if it turns before."""
    def position(times):
        return 0.5 * STEP - short - SPEED * np.abs(np.asarray(times) - corner)
    bad, final = check_steps([0., 4e-6], [1, -1], 0, position, STEP, TICK)
    assert final == 0
    assert list(bad) == ([] if is_right else [0, 1])
