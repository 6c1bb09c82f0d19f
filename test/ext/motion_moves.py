# SPDX-License-Identifier: GPL-3.0-or-later
"""Random moves for the tests of the motion core."""

import math

from hypothesis import strategies as st
from motion_rig import make_move

speeds = st.one_of(st.just(0.0), st.floats(-2.0, 2.7).map(lambda x: 10.0 ** x))


@st.composite
def directions(draw):
    """Along an axis or anywhere, length 1."""
    if draw(st.booleans()):
        axis, sign = draw(st.integers(0, 2)), draw(st.sampled_from([-1.0, 1.0]))
        return tuple(sign if i == axis else 0.0 for i in range(3))
    turn = draw(st.floats(-math.pi, math.pi))
    tilt = draw(st.sampled_from([0.0, 0.3, -1.2]))
    return (math.cos(turn) * math.cos(tilt), math.sin(turn) * math.cos(tilt),
            math.sin(tilt))


@st.composite
def profiles(draw, reach=5.0):
    """(accel_t, cruise_t, decel_t, start_v, cruise_v, accel); some times 0."""
    start_v, end_v = draw(speeds), draw(speeds)
    cruise_v = max(start_v, end_v, draw(speeds))
    accel = 10.0 ** draw(st.floats(1.0, 4.5))
    accel_t, decel_t = (cruise_v - start_v) / accel, (cruise_v - end_v) / accel
    while 0.5 * cruise_v * (accel_t + decel_t) > reach or accel_t + decel_t > 0.5:
        accel, accel_t, decel_t = accel * 2.0, accel_t / 2.0, decel_t / 2.0
    cruise_t = draw(st.one_of(st.just(0.0), st.floats(1e-4, 0.5)))
    cruise_t = min(cruise_t, reach / max(cruise_v, 1e-9))
    return accel_t, cruise_t, decel_t, start_v, cruise_v, accel


@st.composite
def journeys(draw, reach=5.0, flat=False, max_size=12):
    """A list of (pause before in s, direction, profile)."""
    journey = []
    for _ in range(draw(st.integers(1, max_size))):
        pause = draw(st.one_of(st.just(0.0), st.floats(1e-6, 1.0)))
        direction = (1.0, 1.0, 0.0) if flat else draw(directions())
        journey.append((pause, direction, draw(profiles(reach))))
    return journey


def travel(rig, journey, begin):
    """Add all moves; returns the end time."""
    t, position = begin, rig.start
    for pause, direction, (accel_t, cruise_t, decel_t, *speed) in journey:
        move = make_move(accel_t, cruise_t, decel_t, position, direction, *speed)
        t, position = rig.add(t + pause, move)
    return t
