# SPDX-License-Identifier: GPL-3.0-or-later
"""The class of extruders that the toolhead calls in C."""

import pytest

from klippy.movetaker import MoveTaker


def test_a_taker_says_what_it_does_itself():
    taker = MoveTaker()
    for call in (lambda: taker.check_move(None, 3),
                 lambda: taker.calc_junction(None, None, 3),
                 lambda: taker.process_move(0., None, 3)):
        with pytest.raises(NotImplementedError):
            call()
