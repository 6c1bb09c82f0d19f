# SPDX-License-Identifier: GPL-3.0-or-later
"""Find a heater's parameters in a record of its duties and temperatures.

The model is run with the duties of the record, and its parameters are moved
until its sensor shows the temperatures of the record, with least squares
(Levenberg and Marquardt's method, derivatives by differences).  Capacity, lag
and transfer are searched by their logarithms: they are all above 0.
"""

import math

from klippy.extras.thermal_model import ThermalModel
from klippy.record import record

MAX_ROUNDS = 60
# The search ends when a round betters the error by less than this share
TOLERANCE = 1e-7
DIFFERENCE = 1e-4
FIRST_DAMPING, MAX_DAMPING = 1e-3, 1e9


@record(frozen=True)
class Fit:
    """J/K, 1/s, W/K, degC, and the remaining error (degC, rms)."""

    capacity: float
    responsiveness: float
    transfer: float
    ambient: float
    error: float


def run_model(power, values, record):
    """Differences (degC) between the model's sensor and the record.

    values: logs of capacity, responsiveness and transfer; ambient.
    record: (s since the one before, duty meanwhile, degC at the end) each.
    """
    capacity, responsiveness, transfer = (math.exp(v) for v in values[:3])
    model = ThermalModel(power, capacity, responsiveness, transfer)
    start = record[0][2]
    model.reset(start, values[3])
    # a heater that cools down is ahead of its sensor
    model.block -= transfer / capacity * (start - values[3]) / responsiveness
    differences = []
    for elapsed, duty, temp in record:
        model.predict(elapsed, duty)
        differences.append(model.sensor - temp)
    return differences


def fit_heater(power, record, guess, room=None):
    """Fit of a record; power in W.

    guess: (J/K, 1/s, W/K, degC) to begin with.  room: degC if it is known.
    Raises ValueError if the record cannot be explained by a heater.
    """
    values = [math.log(v) for v in guess[:3]] + [guess[3] if room is None else room]
    n_free = 4 if room is None else 3
    differences = run_model(power, values, record)
    damping = FIRST_DAMPING
    for _ in range(MAX_ROUNDS):
        before = _square(differences)
        found = _improve(power, record, values, differences, n_free, damping)
        if found is None:
            break
        values, differences, damping = found
        if before - _square(differences) <= TOLERANCE * before:
            break
    error = math.sqrt(_square(differences) / len(record))
    return Fit(*(math.exp(v) for v in values[:3]), values[3], error)


def _square(differences):
    return sum(d * d for d in differences)


def _improve(power, record, values, differences, n_free, damping):
    """(values, differences, damping) of a better place; None if there is none."""
    columns = []
    for i in range(n_free):
        moved = list(values)
        moved[i] += DIFFERENCE
        columns.append([(b - a) / DIFFERENCE for a, b in zip(
            differences, run_model(power, moved, record), strict=True)])
    normal = [[sum(a * b for a, b in zip(p, q, strict=True)) for q in columns]
              for p in columns]
    right = [-sum(a * d for a, d in zip(p, differences, strict=True))
             for p in columns]
    best = _square(differences)
    while damping < MAX_DAMPING:
        step = _solve_damped(normal, right, damping)
        trial = [v + (step[i] if i < n_free else 0.0)
                 for i, v in enumerate(values)]
        if all(abs(v) < 20.0 for v in trial[:3]):
            result = run_model(power, trial, record)
            if _square(result) < best:
                return trial, result, max(damping * 0.2, 1e-9)
        damping *= 5.0
    return None


def _solve_damped(normal, right, damping):
    """Solution of the normal equations with their diagonal made heavier."""
    n = len(right)
    rows = [[*normal[i], right[i]] for i in range(n)]
    for i in range(n):
        rows[i][i] += damping * normal[i][i] + 1e-12
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(i + 1, n):
            factor = rows[k][i] / rows[i][i]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i], strict=True)]
    solution = [0.0] * n
    for i in reversed(range(n)):
        known = sum(rows[i][k] * solution[k] for k in range(i + 1, n))
        solution[i] = (rows[i][n] - known) / rows[i][i]
    return solution


def guess_heater(power, record):
    """Rough (J/K, 1/s, W/K, degC) of a record that holds a climb.

    Raises ValueError if nothing got warmer in it.
    """
    room = min(temp for _, _, temp in record)
    top = max(temp for _, _, temp in record)
    heat = sum(elapsed * duty * power for elapsed, duty, _ in record)
    if top - room < 10.0 or heat <= 0.0:
        raise ValueError("it did not get warmer by 10 degrees")
    # half of the heat is taken for lost on the way
    climb = [elapsed * duty * power for elapsed, duty, temp in record
             if temp < 0.5 * (room + top)]
    capacity = max(sum(climb), 0.1 * heat) / (0.5 * (top - room))
    return capacity, 0.5, 0.002 * capacity, room
