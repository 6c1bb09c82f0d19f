# SPDX-License-Identifier: GPL-3.0-or-later
"""Load figures of one mcu, from its own periodic report and from the link."""

import math


class McuStats:
    """Keeps the figures that `last_stats` shows."""

    def __init__(self, mcu):
        self._mcu = mcu
        self._sumsq_base = 256.
        self._last_time = 0.
        self.load = {"mcu_awake": 0., "mcu_task_avg": 0., "mcu_task_stddev": 0.}
        self.last_stats = {}

    def register(self, serial):
        """Take in the reports of an identified mcu."""
        self._sumsq_base = serial.msgparser.get_constant_float(
            "STATS_SUMSQ_BASE", 256.)
        serial.register_response(self._handle_stats, "stats")

    def _handle_stats(self, params):
        """count tasks took sum ticks since the last report."""
        count, total = params["count"], params["sum"]
        time = params["#receive_time"]
        elapsed, self._last_time = time - self._last_time, time
        if not count:
            return
        freq = self._mcu.seconds_to_clock(1.)
        spread = params["sumsq"] * self._sumsq_base * count - total * total
        self.load = {
            "mcu_awake": round(total / freq / max(elapsed, 1e-3), 6),
            "mcu_task_avg": round(total / count / freq, 9),
            "mcu_task_stddev": round(math.sqrt(max(0., spread)) / count / freq, 9)}

    def collect(self, eventtime, serial, clocksync):
        """Refresh last_stats; returns its text."""
        stats = dict(self.load)
        stats.update(serial.stats(eventtime))
        stats.update(clocksync.stats(eventtime))
        self.last_stats = {k: float(v) for k, v in stats.items()}
        return " ".join("%s=%s" % (k, format_number(v)) for k, v in stats.items())


def format_number(value):
    """Short text of an int or float."""
    if isinstance(value, float):
        return "%.9f" % (value,) if abs(value) < 1e-3 and value else "%.6g" % (value,)
    return str(value)
