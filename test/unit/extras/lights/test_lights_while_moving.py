# SPDX-License-Identifier: GPL-3.0-or-later
"""A long strip is sent while motors step: neither disturbs the other."""
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "home"))
import motion_bench  # noqa: E402

from klippy.simulator import lights  # noqa: E402

CONFIG = motion_bench.CARTESIAN + """
[neopixel strip]
pin: PA1
chain_count: 100
color_order: RGB
"""


def test_strip_and_steps(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch, CONFIG)
    mcu = bench.machine.mcus["mcu"]
    strip = lights.NeopixelStrip(mcu, bench.machine.pins.lookup("PA1").number, 300)

    def body(it):
        it.send("G28\nG1 X0 Y0 F12000")
        for index in range(60):
            it.send("SET_LED LED=strip RED=%.4f BLUE=1\nG1 X%d Y%d"
                    % (index / 255, 100 * (index % 2), 20 + index))
        it.toolhead.wait_moves()
        it.pause(1.0)
        # steps are served between two bits, late by one of them at most
        assert mcu.max_late_ticks <= 2e-6 * mcu.freq
        assert strip.read() == bytes([59, 0, 255] * 100)
        assert strip.n_updates >= 60
        assert max(it.get_error()) < 0.013
        assert not it.printer.is_shutdown()
    bench.run_ready(body)


def test_colors_change_with_the_moves(tmp_path, monkeypatch):
    bench = motion_bench.MotionBench(tmp_path, monkeypatch, CONFIG)
    mcu = bench.machine.mcus["mcu"]
    strip = lights.NeopixelStrip(mcu, bench.machine.pins.lookup("PA1").number, 300)

    def body(it):
        it.send("G28\nG1 X10 F3000\nM400")
        it.send("G1 X60\nSET_LED LED=strip RED=1\nG1 X160")      # 50 mm/s
        places = []
        while it.machine.calc_position()[0] < 159.0:
            it.pause(0.01)
            if strip.read()[0] and not places:
                places.append(it.machine.calc_position()[0])
        assert places == [pytest.approx(60.0, abs=1.5)]
    bench.run_ready(body)
