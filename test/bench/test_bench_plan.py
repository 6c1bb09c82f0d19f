# SPDX-License-Identifier: GPL-3.0-or-later
"""How long planning a move takes, from its end points to its trapezoid."""

import math
import random

import pytest

from klippy.lookahead import LookAheadQueue, MotionLimits, Move

MOVES = 20000
LIMITS = MotionLimits(300., 3000., 0.5, 5.)


def make_points(length, turn):
    """Ends of moves of about the given length (mm) that turn (rad) a bit."""
    draw = random.Random(1)
    x = y = e = angle = 0.
    points = []
    for _ in range(MOVES):
        angle += draw.uniform(-turn, turn)
        way = draw.uniform(0.5, 1.5) * length
        x += way * math.cos(angle)
        y += way * math.sin(angle)
        e += 0.03 * way
        points.append((x, y, 0.2, e))
    return points


def plan_all(points):
    """Plan as the tool head does; returns the number of planned moves."""
    queue = LookAheadQueue()
    position, count = (0., 0., 0.2, 0.), 0
    for point in points:
        move = Move(LIMITS, position, point, 100.)
        position = point
        last = queue.get_last()
        if last is not None:
            move.calc_junction(last, 1e9)
        if queue.add_move(move):
            count += len(queue.take(False))
    return count + len(queue.take(True))


@pytest.mark.parametrize("length, turn", [(0.3, 0.2), (2., 0.4), (20., 2.)],
                         ids=["curves", "mixed", "infill"])
def test_plan(benchmark, length, turn):
    points = make_points(length, turn)
    assert benchmark(plan_all, points) == MOVES
    us = benchmark.stats.stats.min / MOVES * 1e6
    benchmark.extra_info["us a move"] = round(us, 3)
    print("plan: %.3f us a move" % (us,))
