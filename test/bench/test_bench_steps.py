# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a step takes, from planned motion to messages in the queue.

Run: pytest test/bench/test_bench_steps.py
"""

import math
import pathlib
import random
import sys

import pytest

from klippy_ext.kin_delta import DeltaKinematics
from klippy_ext.kin_extruder import ExtruderKinematics
from klippy_ext.kin_linear import LinearKinematics
from klippy_ext.shaper import ShapedPath

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "ext"))

from motion_rig import Rig, make_move  # noqa: E402

from klippy.extras import shaper_defs, shaper_kernels  # noqa: E402

FREQ = 180e6
TOWERS = [(130.0 * math.cos(a), 130.0 * math.sin(a))
          for a in (math.radians(d) for d in (210.0, 330.0, 90.0))]


def make_cartesian():
    return [LinearKinematics(1.0, 0.0, 0.0), LinearKinematics(0.0, 1.0, 0.0)], 1 / 80


def make_corexy():
    return [LinearKinematics(1.0, 1.0, 0.0), LinearKinematics(1.0, -1.0, 0.0)], 1 / 80


def make_fine_corexy(name=None):
    """320 steps/mm, at 40 Hz if there is a shaper."""
    kinematics = make_corexy()[0]
    for kin in kinematics if name else ():
        path = ShapedPath()
        for axis in range(2):
            if name in shaper_defs.FAMILIES:
                path.set_impulses(axis, *shaper_defs.make_shaper(name, 40., 0.1))
            else:
                path.set_kernel(axis, *shaper_kernels.make_kernel(name, 40., 0.1))
        kin.set_shaper(path)
    return kinematics, 1 / 320


def make_mzv():
    return make_fine_corexy("mzv")


def make_smooth_mzv():
    return make_fine_corexy("smooth_mzv")


def make_delta():
    return [DeltaKinematics(250.0 ** 2, x, y) for x, y in TOWERS], 1 / 80


def make_extruder():
    kin = ExtruderKinematics()
    kin.set_pressure_advance(0.0, 0.05, 0.04)
    return [kin], 1 / 400


def make_curved_extruder():
    kin = ExtruderKinematics()
    kin.set_pressure_advance(0.0, 0.02, 0.04, model="tanh", offset=0.1, velocity=3.0)
    return [kin], 1 / 400


def add_long_moves(rig, speed):
    """60 moves of 100 mm that cruise most of their time."""
    t, position = 1.0, rig.start
    for i in range(60):
        side = 1 - 2 * (i % 2)
        move = make_move(speed / 3e3, 100.0 / speed, speed / 3e3, position,
                         (0.8 * side, 0.6 * side, 0.0), 0.0, speed, 3e3)
        t, position = rig.add(t, move)
    return t


def add_short_moves(rig, speed):
    """4000 segments of 0.5 mm along curves; each changes its speed a bit."""
    draw = random.Random(2)
    t, position, angle, v = 1.0, rig.start, 0.0, speed
    for _ in range(4000):
        angle += draw.uniform(-0.2, 0.25)
        cruise_v = draw.uniform(v, 1.1 * speed)
        end_v = draw.uniform(0.8 * speed, cruise_v)
        up, down = (cruise_v - v) / 3e3, (cruise_v - end_v) / 3e3
        way = 0.5 - 0.5 * (up * (v + cruise_v) + down * (cruise_v + end_v))
        move = make_move(up, max(way, 0.0) / cruise_v, down, position,
                         (math.cos(angle), math.sin(angle), 0.0), v, cruise_v, 3e3)
        t, position = rig.add(t, move)
        v = end_v
    return t


def add_feed(rig, speed):
    """The filament of 600 moves of 10 mm: pushed with advance."""
    t, position = 1.0, rig.start
    for _ in range(600):
        move = make_move(speed / 100.0, 10.0 / speed, speed / 100.0, position,
                         (1.0, 1.0, 0.0), 0.0, speed, 100.0)
        t, position = rig.add(t, move)
    return t


def add_short_feed(rig, speed):
    """The filament of 4000 segments of 0.5 mm at 100 mm/s."""
    t, position, v = 1.0, rig.start, 0.8 * speed
    for i in range(4000):
        end_v = speed if i % 2 else 0.8 * speed
        mean = 0.5 * (v + end_v)
        up = abs(end_v - v) / 100.0
        rest = max(0.016 / mean - up, 0.0)
        times = (up, rest, 0.0) if end_v > v else (0.0, rest, up)
        move = make_move(*times, position, (1.0, 1.0, 0.0), v, max(v, end_v), 100.0)
        t, position = rig.add(t, move)
        v = end_v
    return t


CASES = {
    "cartesian-long": (make_cartesian, add_long_moves, 200.0),
    "corexy-long": (make_corexy, add_long_moves, 200.0),
    "delta-long": (make_delta, add_long_moves, 200.0),
    "extruder-long": (make_extruder, add_feed, 5.0),
    "cartesian-short": (make_cartesian, add_short_moves, 100.0),
    "corexy-short": (make_corexy, add_short_moves, 100.0),
    "delta-short": (make_delta, add_short_moves, 100.0),
    "extruder-short": (make_extruder, add_short_feed, 5.0),
    "fine-long": (make_fine_corexy, add_long_moves, 200.0),
    "fine-mzv-long": (make_mzv, add_long_moves, 200.0),
    "fine-smooth-mzv-long": (make_smooth_mzv, add_long_moves, 200.0),
    "fine-short": (make_fine_corexy, add_short_moves, 100.0),
    "fine-mzv-short": (make_mzv, add_short_moves, 100.0),
    "fine-smooth-mzv-short": (make_smooth_mzv, add_short_moves, 100.0),
    "extruder-curved-long": (make_curved_extruder, add_feed, 5.0),
    "extruder-curved-short": (make_curved_extruder, add_short_feed, 5.0),
}


def prepare(case):
    make, add, speed = CASES[case]
    kinematics, step_dist = make()
    rig = Rig(kinematics, step_dist, FREQ, move_count=100000)
    return rig, add(rig, speed) + 1.0


def make_steps(rig, until):
    t = 0.0
    while t < until:
        t += 0.25
        rig.sync.generate(t + 0.05)
        rig.sync.flush(int(t * FREQ))
    return rig


@pytest.mark.parametrize("case", CASES)
def test_steps(benchmark, case):
    rig = benchmark.pedantic(make_steps, setup=lambda: (prepare(case), {}), rounds=7)
    counts = [sc.get_counts() for sc in rig.steppers]
    n_steps, n_runs = (sum(c) for c in zip(*counts, strict=True))
    ns = benchmark.stats.stats.min / n_steps * 1e9
    benchmark.extra_info["ns a step"] = round(ns, 2)
    benchmark.extra_info["steps a message"] = round(n_steps / n_runs, 1)
    print("%s: %d steps, %.2f ns a step, %.1f steps a message"
          % (case, n_steps, ns, n_steps / n_runs))
    assert n_steps > 10000
