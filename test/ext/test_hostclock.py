# SPDX-License-Identifier: GPL-3.0-or-later
"""The two clocks of the host."""

import time

import pytest

from klippy_ext.hostclock import HostClock, RealClock
from klippy_ext.vworld import VirtualWorld


def test_real_clock_is_the_monotonic_one():
    before = time.monotonic()
    middle = RealClock().monotonic()
    assert before <= middle <= time.monotonic()


def test_virtual_clock_stands_still():
    world = VirtualWorld()
    assert isinstance(world, HostClock)
    assert world.monotonic() == world.monotonic() == 0.
    assert world.advance(2.5) == world.monotonic() == 2.5
    assert world.advance(1.) == 2.5


def test_clock_without_source():
    with pytest.raises(RuntimeError, match="not been started"):
        HostClock().monotonic()
