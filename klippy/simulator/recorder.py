# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of a simulated print for the report, thinned out as they grow."""
from array import array

PATH_PERIOD = 0.02
STATE_PERIOD = 0.5
# A series longer than this loses every second sample.
MAX_PATH = 200000
MAX_STATE = 20000


class Series:
    """Rows of doubles, one array a column, of bounded length."""

    def __init__(self, columns, limit):
        self.columns = {name: array("d") for name in columns}
        self.limit = limit
        self.stride = 1
        self.count = 0

    def __len__(self):
        return len(next(iter(self.columns.values())))

    def append(self, values):
        """Add a row: one value a column, in their order."""
        index, self.count = self.count, self.count + 1
        if index % self.stride:
            return
        for column, value in zip(self.columns.values(), values, strict=True):
            column.append(value)
        if len(self) >= self.limit:
            self.stride *= 2
            self.columns = {n: c[::2] for n, c in self.columns.items()}

    def __getitem__(self, name):
        return self.columns[name]


class Recorder:
    """Position, steps, temperatures and queue margin over virtual time.

    path: t, x, y, z and a step count a stepper, every PATH_PERIOD s.
    state: t, margin and temperature, target a heater; STATE_PERIOD s.
    """

    def __init__(self, machine, heater_names):
        self.machine = machine
        self.heater_names = list(heater_names)
        self.steppers = list(machine.traces)
        self.path = Series(["t", "x", "y", "z", *self.steppers], MAX_PATH)
        columns = ["t", "margin", "fan"]
        for name in self.heater_names:
            columns += [name, name + " target"]
        self.state = Series(columns, MAX_STATE)
        self.is_on = False
        machine.world.add_ticker(PATH_PERIOD, self._sample_path)

    def _sample_path(self, now):
        if not self.is_on:
            return
        position = self.machine.calc_position() or (0.0, 0.0, 0.0)
        counts = self.machine.get_step_counts()
        self.path.append([now, *position, *(counts[n] for n in self.steppers)])

    def note_state(self, now, margin, heaters):
        """Take the host's view: margin in s, {heater: (temp, target)}."""
        row = [now, margin, self.machine.thermal.fan_duties.get("fan", 0.0)]
        for name in self.heater_names:
            row += heaters.get(name, (0.0, 0.0))
        self.state.append(row)
