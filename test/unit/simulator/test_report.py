# SPDX-License-Identifier: GPL-3.0-or-later
"""Recorded series stay bounded, and the report page is complete."""
import re

import pytest

from klippy.simulator import recorder, report


def test_series_keeps_even_spacing_when_it_thins_out():
    series = recorder.Series(["t", "v"], 100)
    for i in range(10000):
        series.append([i, 2.0 * i])
    times = list(series["t"])
    assert 50 <= len(times) < 100
    steps = {b - a for a, b in zip(times, times[1:], strict=False)}
    assert len(steps) == 1
    assert list(series["v"]) == [2.0 * t for t in times]


class StillMachine:
    """A machine whose positions are given by a function of time."""

    def __init__(self):
        self.world = self
        self.traces = {"stepper_x": None, "extruder": None}
        self.thermal = self
        self.fan_duties = {"fan": 0.5}
        self.callbacks = []
        self.now = 0.0

    def add_ticker(self, period, callback):
        self.callbacks.append(callback)

    def calc_position(self):
        return (10.0 * self.now, 5.0, 0.2)

    def get_step_counts(self):
        return {"stepper_x": int(800 * self.now), "extruder": int(self.now)}


@pytest.fixture
def recorded():
    machine = StillMachine()
    taken = recorder.Recorder(machine, ["extruder"])
    taken.is_on = True
    for i in range(400):
        machine.now = 0.05 * i
        machine.callbacks[0](machine.now)
        taken.note_state(machine.now, 1.0, {"extruder": (200.0, 210.0)})
    return taken


def test_page_shows_all_plots_and_escapes_text(tmp_path, recorded):
    pytest.importorskip("matplotlib")
    writer = report.ReportWriter(tmp_path / "out", recorded)
    page = writer.write("a <b> job", [("print time", "5m & 3s")])
    text = page.read_text()
    assert "a &lt;b&gt; job" in text and "5m &amp; 3s" in text
    pictures = re.findall(r'src="([^"]+)"', text)
    assert len(pictures) == 5
    for name in pictures:
        data = (page.parent / name).read_bytes()
        assert data[:8] == b"\x89PNG\r\n\x1a\n" and len(data) > 5000


def test_nothing_is_sampled_while_off():
    machine = StillMachine()
    taken = recorder.Recorder(machine, [])
    machine.callbacks[0](1.0)
    assert len(taken.path) == 0


def test_empty_recording_still_makes_a_page(tmp_path):
    pytest.importorskip("matplotlib")
    taken = recorder.Recorder(StillMachine(), ["extruder"])
    page = report.ReportWriter(tmp_path, taken).write("empty", [])
    assert page.exists()
