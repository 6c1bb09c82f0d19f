# SPDX-License-Identifier: GPL-3.0-or-later
"""The ramp from a standstill back to the plan's pace."""

import numpy as np
import pytest

from klippy.motionhold import RAMP_TIME, Ramp


def convert(pieces, start, times):
    """Seconds of the main mcu for these parts of the plan."""
    result = np.full(len(times), np.nan)
    begin = start
    for offset, pace, end in pieces:
        part = (times >= begin - 1e-12) & (times <= end + 1e-12)
        result[part] = (times[part] - offset) / pace
        begin = end
    return result


@pytest.mark.parametrize("borders", [[100.], [3.02, 3.0200001, 3.07, 3.5],
                                     list(np.arange(3.001, 3.4, 0.003))])
def test_pace_grows_evenly(borders):
    ramp, pieces = Ramp(3., 10.), []
    for border in borders:
        pieces += ramp.list_pieces(border)
    assert ramp.is_over()
    assert ramp.list_pieces(1000.) == []
    plan = np.linspace(3., ramp.end, 1001)
    times = convert(pieces, 3., plan)
    assert times[0] == pytest.approx(10.)
    assert times[-1] == pytest.approx(10. + RAMP_TIME)
    assert np.all(np.diff(times) > 0.)
    # half of the way of an even pace, as the square of time
    exact = 3. + 0.5 * (times - 10.) ** 2 / RAMP_TIME
    assert np.abs(plan - exact).max() < 1e-4
    # and then on by the hold
    assert times[-1] == pytest.approx(ramp.end + ramp.calc_hold())


def test_nothing_before_the_start():
    assert Ramp(3., 10.).list_pieces(3.) == []
