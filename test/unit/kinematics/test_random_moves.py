# SPDX-License-Identifier: GPL-3.0-or-later
"""Random moves through the planner of every machine: no limit is violated."""

import dataclasses
import math
import pathlib

import motion_bench
import numpy as np
import pytest
from truth import curves, gcode, planarray, random_moves

from klippy.configtext import ConfigReader
from klippy.lookahead import LookAheadQueue, Move

CONFIG = pathlib.Path(__file__).resolve().parents[3] / "config"
JOB = 1000
# Of the bed of sample-polar.cfg (50,000 steps a second), and the core of polar
BED_SPEED, CORE = 50000. * 2. * math.pi / (200. * 16. * 5.), 0.01
# Rounding of sums of v2, (mm/s)^2, and relatively
TOLERANCE, RELATIVE = 1e-5, 2e-6
BOX = ((5., 5., 1.), (195., 195., 150.))
LIMITED = ("max_x_velocity: 150\nmax_y_velocity: 70\nmax_x_accel: 2500\n"
           "max_y_accel: 900\n")


def limit_shares(rows, box, join):
    """What LIMITED says; join: how the shares of both accelerations add up."""
    x, y = np.abs(rows["unit"][:, 0]), np.abs(rows["unit"][:, 1])
    moves = (x > 0.) | (y > 0.)
    speed = np.maximum(x / 150., y / 70.)
    accel = join(x / 2500., y / 900.)
    planarray.slow_down(rows, moves, 1. / planarray.positive(speed),
                        1. / planarray.positive(accel))


def limit_edge(rows, box):
    """The carriages of sample-delta.cfg."""
    reach = np.maximum(np.hypot(*rows["start"][:, :2].T),
                       np.hypot(*rows["end"][:, :2].T))
    ratio = (174.75 + reach) / np.sqrt(333. ** 2 - (174.75 + reach) ** 2)
    planarray.slow_down(rows, (ratio > 3.) & ~rows["alone"], 300. * 3. / ratio,
                        3000. * 3. / ratio)


def limit_flat(rows, box):
    """The arms of sample-deltesian.cfg."""
    off = 150. + np.maximum(np.abs(rows["start"][:, 0]), np.abs(rows["end"][:, 0]))
    ratio = off / np.sqrt(260. ** 2 - off ** 2)
    share = np.where(ratio > 6., 0.25, 0.5)
    planarray.slow_down(rows, (rows["unit"][:, 0] != 0.) & (ratio > 3.), share * 300.,
                        share * 3000.)


def limit_turning(rows, box):
    """The bed of sample-polar.cfg, which moves are cut for."""
    start, way = rows["start"][:, :2], rows["end"][:, :2] - rows["start"][:, :2]
    length2 = planarray.positive((way ** 2).sum(axis=1))
    share = np.clip(-(start * way).sum(axis=1) / length2, 0., 1.)
    near = np.hypot(*(start + share[:, None] * way).T)
    far = np.maximum(np.hypot(*start.T), np.hypot(*rows["end"][:, :2].T))
    turns = (way != 0.).any(axis=1) & (near * BED_SPEED < rows["v"] * (1. - 1e-6))
    assert not np.any(turns & (far > np.maximum(2. * near, CORE) * (1. + 1e-5)))
    near = np.where(near < CORE * (1. - 1e-6), CORE / np.pi, near)
    planarray.slow_down(rows, turns, near * BED_SPEED, np.inf)


def limit_swinging(rows, box):
    """The arms of sample-rotary_delta.cfg, seen as vectors."""
    upper, lower, ratio = 160., 320., 0.
    for direction in np.radians((30., 150., 270.)):
        swing = curves.rotary_arm(40., 400., direction, upper, lower)
        for end in ("start", "end"):
            p = rows[end][:, :3]
            out = p[:, 0] * np.cos(direction) + p[:, 1] * np.sin(direction) - 40.
            angle = swing(p)
            # the lower arm's way across the upper one, in the plane of its swing
            across = (p[:, 2] - 400.) * np.cos(angle) - out * np.sin(angle)
            ratio = np.maximum(ratio, lower / np.abs(across))
    planarray.slow_down(rows, (ratio > 3.) & ~rows["alone"], 200. * 3. / ratio,
                        2000. * 3. / ratio)


# Config, box of the moves and limits of the machine itself
MACHINES = {
    "cartesian": ("cartesian", BOX, None),
    "corexy": ("corexy", BOX, None),
    "corexz": ("corexz", BOX, None),
    "hybrid_corexy": ("hybrid_corexy", BOX, None),
    "hybrid_corexz": ("hybrid_corexz", BOX, None),
    "generic_cartesian": ("generic_cartesian", BOX, None),
    "limited_cartesian": ("cartesian", BOX,
                          lambda rows, box: limit_shares(rows, box, np.maximum)),
    "limited_corexy": ("corexy", BOX,
                       lambda rows, box: limit_shares(rows, box, np.add)),
    "delta": ("delta", ((-103., -103., 1.), (103., 103., 60.)), limit_edge),
    "deltesian": ("deltesian", ((-99., 5., 1.), (99., 195., 20.)), limit_flat),
    "polar": ("polar", ((-95., -95., 1.), (95., 5., 60.)), limit_turning),
    "rotary_delta": ("rotary_delta", ((-145., -145., 1.), (145., 145., 60.)),
                     limit_swinging),
    "dual_carriage": ("dual_carriage", BOX, None),
    "winch": ("winch", ((-100., -100., 1.), (100., 100., 100.)), None),
}
# Settings: velocity, acceleration, square corner velocity, cruise ratio
SETTINGS = ((300., 3000., 5., 0.5), (200., 1500., 8., 0.), (500., 20000., 0.5, 0.9),
            (100., 500., 20., 0.3), (300., 3000., 0., 0.5))


def read_config(kind):
    name, _, _ = MACHINES[kind]
    text = (CONFIG / ("sample-%s.cfg" % name)).read_text()
    text = text.replace("min_temp: 0\n", "min_temp: 0\nmin_extrude_temp: 0\n", 1)
    text = text.replace("[printer]\n", "[printer]\n#\n")
    if kind.startswith("limited_"):
        text = text.replace("kinematics: ", "kinematics: limited_")
        text = text.replace("[printer]\n", "[printer]\n" + LIMITED)
    return text


class Planner:
    """The machine's own checks and a queue, without steps."""

    def __init__(self, toolhead):
        self.toolhead, self.kin = toolhead, toolhead.get_kinematics()
        self.extruder = toolhead.get_extruder()

    def run(self, positions, speeds):
        """The planned moves of a job."""
        self.queue, self.planned, self.speeds = LookAheadQueue(), [], []
        points = positions.tolist()
        for start, end, speed in zip(points[:-1], points[1:], speeds.tolist(),
                                     strict=True):
            self.add(start, end, speed)
        return self.planned + self.queue.take(True)

    def add(self, start, end, speed):
        move = Move(self.toolhead.limits, start, end, speed)
        if not move.move_d:
            return
        if move.is_kinematic_move and self.kin.check_move(move):
            speed = math.sqrt(move.max_cruise_v2)
            for share in [*self.kin.list_cuts(move), 1.]:
                to = [a + (b - a) * share for a, b in
                      zip(move.start_pos, move.end_pos, strict=True)]
                self.add(start, to if share < 1. else end, speed)
                start = to
            return
        if move.d_e:
            self.extruder.check_move(move, 3)
        self.speeds.append(speed)
        last = self.queue.get_last()
        if last is not None:
            move.calc_junction(last, self.extruder.calc_junction(last, move, 3))
        if self.queue.add_move(move):
            self.planned += self.queue.take(False)


def to_array(moves):
    """Columns: start and end (4 each), accel, v at start, cruise; times."""
    return np.array([(*m.start_pos, *m.end_pos, m.accel, m.start_v, m.cruise_v,
                      m.accel_t, m.cruise_t, m.decel_t) for m in moves])


def list_wanted(found, positions, speeds, parts):
    """(starts and ends, speeds) of the moves that there should be.

    parts: speeds of those found, if the machine may part moves.
    """
    leads = (positions[1:] != positions[:-1]).any(axis=1)
    if len(found) == leads.sum():
        return np.hstack((positions[:-1], positions[1:]))[leads], speeds[leads]
    # What is asked for must be among the ends, in the order
    ends = iter(map(tuple, found[:, 4:8]))
    assert all(point in ends for point in map(tuple, positions[1:][leads]))
    return found[:, :8], np.array(parts)


def judge(kind, found, wanted, speeds, limits):
    """Number of violations of each rule among the moves of a job."""
    start, end = found[:, :4], found[:, 4:8]
    accel, v0, v1, t0, t1, t2 = found[:, 8:].T
    rows = planarray.make_rows(wanted[:, :4], wanted[:, 4:], speeds, limits)
    if MACHINES[kind][2] is not None:
        MACHINES[kind][2](rows, MACHINES[kind][1])
    v2 = v1 - accel * t2
    least, greatest = planarray.plan(rows, limits)
    squares = (v0 ** 2, v1 ** 2, v2 ** 2)
    way = 0.5 * (v0 + v1) * t0 + v1 * t1 + 0.5 * (v1 + v2) * t2
    wrong = {
        "positions": (start[1:] != end[:-1]).any(axis=1),
        "targets": (end != wanted[:, 4:]).any(axis=1),
        "way": np.abs(way - rows["d"]) > 1e-9 + 1e-9 * rows["d"],
        "accel": accel > rows["a"] * (1. + 1e-9),
        "velocity": v1 > rows["v"] * (1. + 1e-9),
        "ramps": np.abs(v0 + accel * t0 - v1) > 1e-6,
        "times": (t0 < 0.) | (t1 < 0.) | (t2 < -1e-12),
        "jumps": np.abs(v0[1:] ** 2 - v2[:-1] ** 2) > TOLERANCE,
        "rests": np.array([v0[0] ** 2, v2[-1] ** 2]) > TOLERANCE,
    }
    for name, value, lo, hi in zip(("start", "cruise", "end_v"), squares, least,
                                   greatest, strict=True):
        wrong["fast " + name] = value > hi * (1. + RELATIVE) + TOLERANCE
        wrong["slow " + name] = value < lo * (1. - RELATIVE) - TOLERANCE
    return {name: int(np.count_nonzero(bad)) for name, bad in wrong.items()
            if np.any(bad)}


def read_limits(toolhead, config, settings):
    """Set the printer up; returns the Limits that hold then."""
    toolhead.set_max_velocities(*settings)
    lim = gcode.Limits.from_config(config)
    if config["printer"]["kinematics"] == "winch":
        lim = dataclasses.replace(lim, max_z_velocity=math.inf, max_z_accel=math.inf)
    if config["printer"]["kinematics"] == "rotary_delta":
        lim = dataclasses.replace(lim, max_z_accel=math.inf)
    velocity, accel, corner, ratio = settings
    return dataclasses.replace(lim, max_velocity=velocity, max_accel=accel,
                               corner_velocity=corner, cruise_ratio=ratio)


def check(it, kind, config, count, seed):
    """Let count random moves be planned and judged, JOB by JOB."""
    rng = np.random.default_rng(seed)
    (low, high), toolhead = MACHINES[kind][1], it.toolhead
    toolhead.set_position([low[0], low[1], low[2], 0.], "xyz")
    planner = Planner(toolhead)
    for job in range(count // JOB):
        limits = read_limits(toolhead, config, SETTINGS[job % len(SETTINGS)])
        positions, speeds = random_moves.make_job(rng, JOB, low, high)
        found = to_array(planner.run(positions, speeds))
        assert len(found) > 0.9 * JOB
        wanted, speeds = list_wanted(found, positions, speeds, planner.speeds)
        wrong = judge(kind, found, wanted, speeds, limits)
        assert not wrong, (kind, seed, job, wrong)


def run(tmp_path, monkeypatch, kind, count, seed):
    text = read_config(kind)
    (tmp_path / "sample.cfg").write_text(text)
    store = ConfigReader().read(str(tmp_path / "sample.cfg"))
    config = {n: dict(store.items(n)) for n in store.sections()}
    bench = motion_bench.MotionBench(tmp_path, monkeypatch, text)
    bench.run_ready(lambda it: check(it, kind, config, count, seed))


@pytest.mark.parametrize("kind", MACHINES)
def test_random_moves(tmp_path, monkeypatch, kind):
    run(tmp_path, monkeypatch, kind, 5 * JOB, 1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", MACHINES)
def test_million_random_moves(tmp_path, monkeypatch, kind):
    run(tmp_path, monkeypatch, kind, 1000 * JOB, 2)
