# SPDX-License-Identifier: GPL-3.0-or-later
"""The queue of planned motion by itself."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_moves import journeys
from motion_rig import make_move, split_move

from klippy_ext.trapq import TrapMove, TrapQ

MOVE = (0.1, 0.5, 0.2, (1.0, 2.0, 3.0), (0.6, 0.8, 0.0), 0.0, 10.0, 100.0)


def extract(tq, start=-1.0, end=1e9, limit=10 ** 6):
    return tq.extract_old(limit, start, end)


def near(a, b):
    return all(math.isclose(p, q, abs_tol=1e-9) for p, q in zip(a, b, strict=True))


def test_phases_of_a_move():
    tq = TrapQ()
    tq.append(2.0, make_move(*MOVE))
    last, middle, first = extract(tq)
    assert near(first, (2.0, 0.1, 0.0, 100.0, 1.0, 2.0, 3.0, 0.6, 0.8, 0.0))
    assert near(middle, (2.1, 0.5, 10.0, 0.0, 1.3, 2.4, 3.0, 0.6, 0.8, 0.0))
    assert near(last, (2.6, 0.2, 10.0, -100.0, 4.3, 6.4, 3.0, 0.6, 0.8, 0.0))
    tq.check()


@settings(max_examples=60, deadline=None)
@given(journeys(max_size=40), st.floats(0.0, 30.0), st.floats(0.0, 30.0),
       st.integers(1, 50))
def test_history_is_what_was_planned(journey, start, end, limit):
    tq, t, position, pieces = TrapQ(), 0.5, (0.0, 0.0, 0.0), []
    for pause, direction, (a, c, d, *speed) in journey:
        move = make_move(a, c, d, position, direction, *speed)
        tq.append(t + pause, move)
        new, t, position = split_move(t + pause, move)
        pieces += new
        tq.check()
    got = extract(tq, start, end, limit)
    wanted = [p[:10] for p in reversed(pieces) if p[0] < end and p[0] + p[1] > start]
    wanted = [p for p in wanted if p[2] or p[3]][:limit]
    got = [g for g in got if g[2] or g[3]]
    # ends that meet the limits to the last bit may fall on either side
    if len(got) == len(wanted):
        assert all(near(g, w) for g, w in zip(got, wanted, strict=True))
    else:
        assert abs(len(got) - len(wanted)) <= 2


def test_memory_is_bounded_on_a_long_run():
    tq, t = TrapQ(), 0.0
    for _ in range(20000):
        tq.append(t, make_move(0.0, 0.05, 0.0, (0, 0, 0), (1, 0, 0), 1.0, 1.0, 0.0))
        t += 0.05
        tq.finalize(t - 1.0, t - 5.0)
        assert len(extract(tq)) <= 102
    tq.check()
    tq.finalize(1e9, 1e9)
    assert len(extract(tq)) == 1        # where it rests


def test_what_is_needed_for_steps_is_never_forgotten():
    tq = TrapQ()
    for t in (1.0, 2.0, 3.0):
        tq.append(t, make_move(*MOVE))
    tq.finalize(2.0, 1e9)
    assert min(r[0] for r in extract(tq)) == 2.0


def test_set_position_drops_what_was_planned_for_later():
    tq = TrapQ()
    tq.append(1.0, make_move(*MOVE))
    tq.append(5.0, make_move(*MOVE))
    tq.set_position(1.35, 7.0, 8.0, 9.0)
    tq.check()
    mark, cut, first = extract(tq)
    assert near(mark, (1.35, 0.0, 0.0, 0.0, 7.0, 8.0, 9.0, 0.0, 0.0, 0.0))
    assert near(cut[:3], (1.1, 0.25, 10.0))
    tq.append(2.0, make_move(0.0, 1.0, 0.0, (7.0, 8.0, 9.0), (1, 0, 0), 1.0, 1.0, 0.0))
    tq.check()
    assert extract(tq)[0][4] == 7.0 and len(extract(tq)) == 4


def test_set_position_again_and_again():
    tq = TrapQ()
    for i in range(200):
        tq.set_position(3.0, float(i), 0.0, 0.0)
        tq.check()
    assert [r[4] for r in extract(tq)] == [199.0]
    tq.set_position(2.0, 0.0, 0.0, 0.0)
    tq.check()
    assert len(extract(tq)) == 1


@pytest.mark.parametrize("name", ["accel_t", "start_y", "axes_r_z", "cruise_v"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_wrong_values_change_nothing(name, value):
    tq, move = TrapQ(), make_move(*MOVE)
    tq.append(1.0, move)
    before = extract(tq)
    setattr(move, name, value)
    with pytest.raises(ValueError, match="finite"):
        tq.append(3.0, move)
    assert extract(tq) == before
    tq.check()


def test_a_line_is_cut_as_an_arc():
    arc, line = make_move(*MOVE), make_move(*MOVE)
    arc.turn, arc.normal = 0.5, 2
    line.axes_r_x, line.axes_r_y = 1.0, 0.0
    line.start_v, line.cruise_v, line.accel = 0.0, 0.5, 5.0
    arcs, lines, plain = TrapQ(), TrapQ(), TrapQ()
    arcs.append(2.0, arc)
    lines.append_like(2.0, line, arc)
    plain.append(2.0, line)
    lines.check()
    rows, whole = extract(lines), extract(plain)
    assert len(rows) > len(whole) == 3
    borders = {row[0] for row in extract(arcs)}
    assert {row[0] for row in rows} <= borders
    for row in rows:
        time, speed, at = row[0], row[2], row[4]
        start = next(r for r in whole if r[0] <= time + 1e-12)
        t = time - start[0]
        assert math.isclose(speed, start[2] + start[3] * t, abs_tol=1e-12)
        assert math.isclose(at, start[4] + (start[2] + 0.5 * start[3] * t) * t,
                            abs_tol=1e-12)
    arc.turn = math.nan
    with pytest.raises(ValueError, match="finite"):
        lines.append_like(3.0, line, arc)
    assert extract(lines) == rows


def test_wrong_times():
    tq, move = TrapQ(), make_move(*MOVE)
    move.decel_t = -1e-9
    with pytest.raises(ValueError, match="negative"):
        tq.append(1.0, move)
    with pytest.raises(ValueError, match="finite"):
        tq.set_position(math.nan, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="NULL"):
        TrapQ.from_pointer(0)
    with pytest.raises(RuntimeError):
        tq.__init__()
    assert tq.extract_old(0, 0.0, 1.0) == []
    assert TrapMove().accel_t == 0.0
