# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare what the pins of a printer did with what G-code and config ask for.

The model is `truth`; from the host it takes only where and when the machine
rested before the job, and the times at which print_time was moved ahead.
"""

import dataclasses

import numpy as np
from truth import curves, gcode, machines, plan, shaping
from truth.path import Path
from truth.steps import TOLERANCE, check_counts, check_steps, worst_error

# Steps looked at to find out which of the times is the start of a sequence
PROBE_STEPS = 300
SAMPLE_PERIOD = 0.002


@dataclasses.dataclass
class Motor:
    """One stepper: exact position (mm, relative to count 0) as f(path, times)."""
    name: str
    position: object
    step_dist: float
    times: np.ndarray
    directions: np.ndarray
    start_count: int


class Judge:
    """Checks the steps of one run of a job against the model."""

    def __init__(self, run, config_text, job, start, smooth_time=0.04,
                 extra_limit=None, tolerance=TOLERANCE, cut=None, more=None,
                 clock_errors=None):
        """start: Snapshot before the job.  extra_limit, cut: see truth.plan.plan().

        more: {stepper: (position(xyz (n, 3)), mm a step)} beside the usual ones.
        clock_errors: {stepper: s by which the clock of its mcu may be known wrongly}.
        """
        self.run, self.start, self.extra_limit = run, start, extra_limit
        self.cut, self.more = cut, more or {}
        self.config = machines.read_config(config_text)
        self.smooth_time, self.window = smooth_time, 0.5 * smooth_time
        self.make_path = Path
        if "input_shaper" in self.config:
            shaper = shaping.Shaping(self.config["input_shaper"])
            self.make_path = shaper.make_path
            self.window = max(self.window, shaper.window) if (
                not shaper.is_filament_shaped) else self.window + shaper.window
        self.bound, self.clock_errors = tolerance, clock_errors or {}
        self.tick = 1. / run.freq
        self.motors = self._list_motors()
        advance = float(self.config.get("extruder", {}).get("pressure_advance", 0.))
        reader = gcode.Reader(gcode.Limits.from_config(self.config), start.position,
                              advance)
        self.sequences = reader.read(job)
        self.end_position = reader.position
        # Drawing back is averaged, too, before anything is printed
        self.is_smoothed = any(m.advance for s in self.sequences for m in s.moves)

    def _list_motors(self):
        motors = []
        known = {**machines.steppers(self.config), **self.more}
        for name, (function, step_dist) in known.items():
            motors.append(self._make_motor(
                name, lambda path, t, f=function: f(path.xyz(t)), step_dist))
        if "stepper_bed" in self.config:
            motors.append(self._make_bed("stepper_bed"))
        if "extruder" in self.config:
            section = self.config["extruder"]
            motors.append(self._make_motor(
                "extruder", lambda path, t: path.extruder(
                    t, 1. if self.is_smoothed else 0., self.smooth_time),
                machines.step_distance(section)))
        return motors

    def _make_motor(self, name, function, step_dist):
        origin = self.start.origins[name]
        times, directions = self.run.get_steps(name)
        return Motor(name, lambda path, t: function(path, t) - origin, step_dist,
                     times, directions, self.start.counts[name])

    def _make_bed(self, name):
        """A bed that turns: its path begins in the turn in which it then is."""
        step_dist = machines.step_distance(self.config[name])
        origin, start_count = self.start.origins[name], self.start.counts[name]
        times, directions = self.run.get_steps(name)

        def position(path, t):
            done = directions[:np.searchsorted(times, path.t0[0])]
            is_at = origin + (start_count + np.sum(done)) * step_dist
            angle = np.arctan2(path.y[0], path.x[0])
            turns = np.round((is_at - angle) / (2. * np.pi))
            return curves.bed_angle(path, t, angle + 2. * np.pi * turns) - origin
        return Motor(name, position, step_dist, times, directions, start_count)

    # When sequences begin

    def find_path(self):
        """The Path of the whole job."""
        rows, time = [], self.start.print_time
        everything = np.sort(np.concatenate([m.times for m in self.motors]))
        pause, self.begins = 0., []
        for sequence in self.sequences:
            moves = plan.plan(sequence.moves, self.extra_limit, self.cut)
            if moves:
                begin = self._find_start(moves, time, pause, everything)
                self.begins.append(begin)
                more, time = plan.pieces(moves, begin)
                rows += more
                pause = 0.
            pause += sequence.pause
        return self.make_path(rows)

    def _find_start(self, moves, time, pause, everything):
        """The time, of those known to the host, that fits the first steps."""
        candidates = {time + pause}
        for sync in self.run.sync_times:
            if sync >= time:
                candidates |= {sync, sync + pause}
        # The drive moves half a window before and after the head, and so do
        # motors that are shaped
        window = self.window + self.bound
        first = np.searchsorted(everything, time + window)
        latest = everything[first] + window if first < len(everything) else np.inf
        scores = []
        for c in sorted((c for c in candidates if c <= latest), reverse=True):
            scores.append((self._count_bad(moves, c), -c))
            if not scores[-1][0]:
                break
        if not scores:
            raise AssertionError("no time from which %s to %s can begin"
                                 % (moves[0].start, moves[-1].end))
        return -min(scores)[1]

    def _count_bad(self, moves, begin):
        rows, end = plan.pieces(moves, begin)
        path, bad = self.make_path(rows), 0
        for motor in self.motors:
            low, high = np.searchsorted(motor.times, [begin - self.bound, end])
            part = slice(low, min(high, low + PROBE_STEPS))
            count = motor.start_count + int(np.sum(motor.directions[:low]))
            wrong, _ = check_steps(
                motor.times[part], motor.directions[part], count,
                lambda t, m=motor: m.position(path, t), motor.step_dist, self.tick,
                self._get_bound(motor))
            bad += len(wrong)
        return bad

    # Verdict

    def check(self):
        """All of it; returns {stepper: number of steps}."""
        path = self.find_path()
        assert self.run.count_late_events() == 0
        for motor in self.motors:
            self._check_motor(motor, path)
        end = self.run.snapshots[-1].position
        assert np.allclose(end, self.end_position, rtol=0., atol=1e-9)
        return {m.name: len(m.times) for m in self.motors}

    def _get_bound(self, motor):
        return self.bound + self.clock_errors.get(motor.name, 0.)

    def _check_motor(self, motor, path):
        bound = self._get_bound(motor)

        def exact(t):
            return motor.position(path, t)
        args = (motor.times, motor.directions, motor.start_count, exact,
                motor.step_dist)
        bad, final = check_steps(*args, self.tick, bound)
        assert not len(bad), self._describe(motor, args, bad)
        end = path.t1[-1]
        rest = exact(np.array([end + 10.]))[0] / motor.step_dist
        assert abs(final - rest) <= 0.5 + 1e-6, (motor.name, final, rest)
        at = np.concatenate([np.arange(path.t0[0] - 0.1, end + 0.1, SAMPLE_PERIOD),
                             path.t0, path.t1])
        missing = check_counts(*args, bound + self.tick, at)
        assert not len(missing), "%s: count wrong at %d moments, first %.6f s" % (
            motor.name, len(missing), at[missing[0]])

    def _describe(self, motor, args, bad):
        errors = [worst_error(*args, i) for i in bad[:20]]
        return "%s: %d of %d steps off; first %s at %.6f s, by %s us" % (
            motor.name, len(bad), len(motor.times), bad[0], motor.times[bad[0]],
            ", ".join("%.1f" % (e * 1e6) for e in errors))

