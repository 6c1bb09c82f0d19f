# SPDX-License-Identifier: GPL-3.0-or-later
"""Batch mode: run it, and turn its output into steps at pins."""

import dataclasses
import io
import os
import pathlib
import re
import subprocess
import sys

import numpy as np

from klippy.cli import dump

ROOT = pathlib.Path(__file__).resolve().parents[2]
FIELD = re.compile(r"(\w+)=(\S+)")


def run_batch(config, job, dictionary, folder, cores=None):
    """Output file of a batch run of texts; AssertionError if it fails.

    cores: the processors that it may use; None for all.
    """
    config_path, job_path = folder / "batch.cfg", folder / "batch.gcode"
    config_path.write_text(config)
    job_path.write_text(job)
    output = folder / "batch.serial"
    result = subprocess.run(
        [sys.executable, "-m", "klippy", "run", str(config_path), "-i", str(job_path),
         "-o", str(output), "-d", str(dictionary)], cwd=ROOT, text=True,
        capture_output=True, env=dict(os.environ, PYTHONPATH=str(ROOT)),
        preexec_fn=cores and (lambda: os.sched_setaffinity(0, cores)))
    assert not result.returncode, result.stderr[-3000:]
    return output


def read_lines(output, dictionary):
    """Commands of an output file as text."""
    text = io.StringIO()
    dumper = dump.Dump(dump.read_dictionary(str(dictionary)), text)
    with open(output, "rb") as source:
        dumper.write_file(source)
    assert not dumper.list_faults()
    return text.getvalue().splitlines()


class BatchStepper:
    """What an mcu does with the commands for one stepper."""

    def __init__(self, pin):
        self.pin, self.clock, self.direction = pin, 0, 0
        self.clocks, self.directions = [], []

    def feed(self, name, fields):
        if name == "reset_step_clock":
            self.clock = fields["clock"]
        elif name == "set_next_step_dir":
            self.direction = 1 if fields["dir"] else -1
        elif name == "queue_step":
            k = np.arange(fields["count"], dtype=np.int64)
            steps = self.clock + np.cumsum(fields["interval"] + fields["add"] * k)
            assert self.direction and np.all(np.diff(steps) > 0)
            self.clock = int(steps[-1])
            self.clocks.append(steps)
            self.directions.append(np.full(len(k), self.direction))

    def finish(self):
        empty = [np.zeros(0, dtype=np.int64)]
        return (np.concatenate(empty + self.clocks),
                np.concatenate(empty + self.directions))


def decode_steps(lines):
    """{step pin: (clocks (n,), directions (n,))} of dumped commands."""
    steppers = {}
    for line in lines:
        name = line.split(" ", 1)[0]
        fields = {k: v for k, v in FIELD.findall(line)}
        if name == "config_stepper":
            steppers[fields["oid"]] = BatchStepper(fields["step_pin"])
        elif name in ("reset_step_clock", "set_next_step_dir", "queue_step"):
            steppers[fields["oid"]].feed(name, {k: int(v) for k, v in fields.items()})
    return {s.pin: s.finish() for s in steppers.values()}


class BatchRun:
    """Looks like a PrinterRun to the judge; times begin with the batch."""

    START_TIME = 0.25       # print_time of the first move of a batch

    def __init__(self, steps, pins, live):
        """steps: decode_steps().  pins: {stepper: step pin}.  live: PrinterRun."""
        self.freq = live.freq
        self.steps = {name: steps[pin] for name, pin in pins.items()}
        self.sync_times = [self.START_TIME]
        start = dataclasses.replace(live.snapshots[0], print_time=0.)
        self.snapshots = [start, live.snapshots[-1]]

    def get_steps(self, stepper):
        """(print_time (n,) s, directions (n,))."""
        clocks, directions = self.steps[stepper]
        return clocks / self.freq, directions

    def count_late_events(self):
        """No mcu has run."""
        return 0
