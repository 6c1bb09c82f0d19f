# SPDX-License-Identifier: GPL-3.0-or-later
"""A stepper without an mcu: moves in, decoded step clocks out."""

import pathlib
import sys

import numpy as np

from klippy_ext import msgblock
from klippy_ext.stepcompress import StepCompress
from klippy_ext.steppersync import MessageStore, StepperSync
from klippy_ext.trapq import TrapMove, TrapQ

ROOT = str(pathlib.Path(__file__).resolve().parent.parent)
if ROOT not in sys.path:
    sys.path.insert(0, ROOT)

from truth.path import Path  # noqa: E402
from truth.steps import check_steps, worst_error  # noqa: E402

QUEUE_STEP, SET_DIR = 11, 300


def make_move(accel_t, cruise_t, decel_t, start, ratio, start_v, cruise_v, accel):
    """A TrapMove; start and ratio are (x, y, z)."""
    move = TrapMove()
    move.accel_t, move.cruise_t, move.decel_t = accel_t, cruise_t, decel_t
    move.start_x, move.start_y, move.start_z = start
    move.axes_r_x, move.axes_r_y, move.axes_r_z = ratio
    move.start_v, move.cruise_v, move.accel = start_v, cruise_v, accel
    return move


def split_move(t, move, advance_flag=0.0):
    """The move's pieces, as truth.path wants them, by plain arithmetic."""
    pieces, s = [], 0.0
    phases = ((move.accel_t, move.start_v, move.accel),
              (move.cruise_t, move.cruise_v, 0.0),
              (move.decel_t, move.cruise_v, -move.accel))
    start = (move.start_x, move.start_y, move.start_z)
    ratio = (move.axes_r_x, move.axes_r_y, move.axes_r_z)
    for duration, v, a in phases:
        if not duration:
            continue
        at = [p + r * s for p, r in zip(start, ratio, strict=True)]
        pieces.append((t, duration, v, a, *at, *ratio, at[0], ratio[0],
                       advance_flag))
        s += v * duration + 0.5 * a * duration ** 2
        t += duration
    return pieces, t, [p + r * s for p, r in zip(start, ratio, strict=True)]


def decode(messages):
    """Commands as (name, [arguments], min_clock, req_clock)."""
    result = []
    for data, min_clock, req_clock in messages:
        numbers, pos = [], 0
        while pos < len(data):
            value, pos = read_int(data, pos)
            numbers.append(value)
        name = {QUEUE_STEP: "step", SET_DIR: "dir"}.get(numbers[0], "other")
        result.append((name, numbers[1:], min_clock, req_clock))
    return result


def read_int(data, pos):
    value, used = msgblock.decode_int(data[pos:])
    return value, pos + used


def run_firmware(commands, start_clock=0, invert=False):
    """Step clocks and directions by the rules of the mcu; clocks 64 bit.

    As the wire has 32 bit only, an interval that is short of req_clock by
    whole turns is a long rest.
    """
    clock, direction, clocks, directions = start_clock, None, [], []
    for name, args, _, req_clock in commands:
        if name == "dir":
            direction = (1 if args[1] else -1) * (-1 if invert else 1)
        elif name == "step":
            _, interval, count, add = args
            add -= (add & 0x80000000) << 1
            clock += (req_clock - clock - interval) >> 32 << 32
            assert 0 < count <= 0xffff and -0x8000 <= add <= 0x7fff
            k = np.arange(count, dtype=np.int64)
            intervals = interval + add * k
            assert np.all((intervals > 0) & (intervals < 1 << 32))
            clocks.append(clock + np.cumsum(intervals))
            directions.append(np.full(count, direction, dtype=np.int64))
            clock = int(clocks[-1][-1])
    if not clocks:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    return np.concatenate(clocks), np.concatenate(directions)


def check_between(times, directions, exact, step_dist, until, tolerance):
    """At no time may the count be further off than half a step, give or take."""
    sample = np.linspace(max(until - 4.0, 0.0), until, 4001)
    count = np.concatenate([[0], np.cumsum(directions)])
    count = count[np.searchsorted(times, sample, side="right")]
    near = np.stack([exact(sample + d) for d in (-tolerance, 0.0, tolerance)])
    assert np.all(near.min(axis=0) / step_dist - 0.51 <= count)
    assert np.all(near.max(axis=0) / step_dist + 0.51 >= count)


class Rig:
    """One or more steppers of one queue of moves on one imaginary mcu."""

    def __init__(self, kinematics, step_dist, freq=16e6, move_count=1000,
                 start=(0.0, 0.0, 0.0), max_error=25e-6, advance_flag=0.0):
        self.freq, self.step_dist, self.start = freq, step_dist, start
        self.advance_flag = advance_flag
        self.tq = TrapQ()
        self.store = MessageStore()
        self.sync = StepperSync(self.store, move_count)
        self.kinematics, self.steppers = kinematics, []
        for oid, kin in enumerate(kinematics):
            sc = StepCompress(oid)
            sc.configure(int(max_error * freq), QUEUE_STEP, SET_DIR)
            kin.set_trapq(self.tq)
            kin.set_stepcompress(sc, step_dist)
            kin.set_position(*start)
            self.sync.add(sc, kin)
            self.steppers.append(sc)
        self.sync.set_time(0.0, freq)
        self.commands, self.pieces = [], []

    def add(self, t, move):
        """Append a move; returns (its end, the position there)."""
        self.tq.append(t, move)
        pieces, end, position = split_move(t, move, self.advance_flag)
        self.pieces += pieces
        self.position = np.array(position)
        return end, position

    def run(self, until, flush_period=0.25, ahead=0.05, begin=0.0):
        """Make and send everything up to `until` (s), in slices."""
        t = begin
        while t < until:
            t = min(t + flush_period, until)
            self.sync.generate(t + ahead)
            self.sync.flush(int(t * self.freq))
            self.sync.check()
            self.commands += decode(self.store.take())
        self.tq.check()
        for sc in self.steppers:
            sc.check()

    def steps(self, oid=0):
        """(clocks, directions) of one stepper."""
        return run_firmware([c for c in self.commands if c[1][0] == oid])

    def check(self, position, oid=0, tolerance=25e-6, between=True):
        """All steps in bounds, none missing; returns (clocks, directions).

        position: f(Path, times) -> mm of the stepper, shape of times.
        """
        if not self.pieces:
            assert not len(self.steps(oid)[0])
            return self.steps(oid)
        path = Path(self.pieces)
        origin = float(self.kinematics[oid].calc_position_from_coord(*self.start))
        clocks, directions = self.steps(oid)

        def exact(times):
            return position(path, times) - origin
        if len(clocks):
            assert np.all(np.diff(clocks) > 0)
            bad, final = check_steps(clocks / self.freq, directions, 0, exact,
                                     self.step_dist, 1.0 / self.freq, tolerance)
            assert not len(bad), "%d of %d steps off, first %d by %.3g s" % (
                len(bad), len(clocks), bad[0],
                worst_error(clocks / self.freq, directions, 0, exact,
                            self.step_dist, bad[0]))
        else:
            final = 0
        end = exact(np.array([path.t1.max() + 10.0]))[0] / self.step_dist
        assert abs(end - final) <= 0.5 + 1e-5
        if between:
            check_between(clocks / self.freq, directions, exact, self.step_dist,
                          path.t1.max(), tolerance + 1.0 / self.freq)
        assert self.steppers[oid].get_last_position() == final
        return clocks, directions
