# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress lines and the layer index."""
import io

import pytest

from klippy.simulator import progress


def make_snapshot(**changes):
    values = {"filename": "cube.gcode", "state": "printing", "fraction": 0.25,
              "layer": 3, "n_layers": 12, "position": (1.0, 2.0, 0.6),
              "elapsed": 90.0, "heaters": {"extruder": (209.6, 210.0)}}
    return progress.Snapshot(**{**values, **changes})


@pytest.mark.parametrize("seconds,text", [
    (0.4, "0s"), (59.6, "1m00s"), (3599.4, "59m59s"), (3725.0, "1h02m05s")])
def test_format_duration(seconds, text):
    assert progress.format_duration(seconds) == text


def test_line_has_everything():
    line = progress.format_line(make_snapshot(), 123.4)
    for part in ("cube.gcode", "25%", "layer 3/12", "extruder 210/210",
                 "X1.0 Y2.0 Z0.60", "123x", "1m30s", "4m30s left"):
        assert part in line


def test_no_estimate_at_the_start():
    assert make_snapshot(fraction=0.001).calc_remaining() is None


@pytest.mark.parametrize("mark", [
    b";LAYER_CHANGE\n;Z:0.2\n;AFTER_LAYER_CHANGE\n", b";LAYER:0\n",
    b"; layer 1, Z = 0.2\n"])
def test_layers_are_counted_once_for_each_slicer(tmp_path, mark, monkeypatch):
    monkeypatch.setattr(progress, "BLOCK", 64)
    body = b"G28\n" + (mark + b"G1 X1 Y2 E3\n" * 7) * 5
    path = tmp_path / "job.gcode"
    path.write_bytes(body)
    layers = progress.LayerIndex(path)
    assert len(layers) == 5
    assert layers.lookup(0) == 0
    assert layers.lookup(len(body)) == 5
    second = body.index(mark, 10)
    assert (layers.lookup(second - 1), layers.lookup(second)) == (1, 2)


def test_lines_go_out_at_intervals_of_wall_time():
    wall = [100.0]
    stream = io.StringIO()
    display = progress.ProgressDisplay(stream, wall_clock=lambda: wall[0])
    assert display.is_due()
    display.update(0.0, make_snapshot())
    assert not display.is_due()
    wall[0] += progress.LINE_INTERVAL
    assert display.is_due()
    display.update(500.0, make_snapshot())
    lines = stream.getvalue().splitlines()
    assert len(lines) == 2
    assert "100x" in lines[1]


def test_terminal_line_is_rewritten():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    stream = Terminal()
    display = progress.ProgressDisplay(stream, wall_clock=lambda: 0.0)
    display.write_line("a long line")
    display.write_line("short")
    display.write_message("done")
    assert stream.getvalue() == (
        "\ra long line\rshort      \r     \rdone\n")
