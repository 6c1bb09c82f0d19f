# SPDX-License-Identifier: GPL-3.0-or-later
"""Every sample config homes and moves; the simulated machine is where it should."""

import pathlib

import motion_bench
import pytest

CONFIG = pathlib.Path(__file__).resolve().parents[3] / "config"
# Where to go after homing, and how far off steps may leave a machine (mm)
TOURS = {
    "cartesian": ("G1 X50 Y60 Z7 F6000\nG1 X20 Y90 Z3.3", 0.0125),
    "limited_cartesian": ("G1 X50 Y60 Z7 F6000\nG1 X20 Y90 Z3.3", 0.0125),
    "corexz": ("G1 X50 Y60 Z7 F6000\nG1 X20 Y90 Z3.3", 0.0125),
    "hybrid_corexy": ("G1 X50 Y60 Z7 F6000\nG1 X20 Y90 Z3.3", 0.0125),
    "hybrid_corexz": ("G1 X50 Y60 Z7 F6000\nG1 X20 Y90 Z3.3", 0.0125),
    "delta": ("G1 X50 Y60 Z7 F6000\nG1 X-20 Y90 Z3.3", 0.025),
    "deltesian": ("G1 X50 Y60 Z7 F6000\nG1 X-20 Y90 Z3.3", 0.025),
    "rotary_delta": ("G1 X50 Y60 Z7 F6000\nG1 X-20 Y70 Z3.3", 0.05),
    "polar": ("G1 X50 Y60 Z7 F6000\nG1 X-20 Y90 Z3.3\nG1 X20 Y-90\nG1 X60 Y-90\n"
              "G1 X0 Y0\nG1 X30 Y-20", 0.025),
    "generic_cartesian": ("G1 X50 Y60 Z7 F6000\nG1 X20 Y90 Z3.3", 0.0125),
    "dual_carriage": ("G1 X50 Y60 Z7 F6000\nG1 X20 Y90 Z3.3", 0.0125),
    "winch": ("G1 X50 Y60 Z7 F6000\nG1 X-20 Y90 Z3.3", 0.05),
}


@pytest.mark.parametrize("kind", [*TOURS, "hybrid_corexy inverted",
                                  "hybrid_corexz inverted"])
def test_sample_homes_and_moves(tmp_path, monkeypatch, kind):
    kind, _, is_inverted = kind.partition(" ")
    tour, bound = TOURS[kind]

    def body(it):
        it.send("G28")
        status = it.get("toolhead")
        assert status["homed_axes"] == "xyz"
        assert max(it.get_error()) < bound
        it.send(tour)
        assert max(it.get_error()) < bound
        kin = it.toolhead.get_kinematics()
        found = kin.calc_position({s.get_name(): s.get_commanded_position()
                                   for s in kin.get_steppers()})
        assert found == pytest.approx(it.toolhead.get_position()[:3], abs=bound)
        it.send("M84")
        assert it.get("toolhead")["homed_axes"] == ("xyz" if kind == "winch" else "")
    text = (CONFIG / ("sample-%s.cfg" % kind)).read_text()
    if is_inverted:
        text = text.replace("kinematics: " + kind,
                            "kinematics: %s\ninvert_kinematics: True" % (kind,))
        assert "invert_kinematics" in text
    motion_bench.MotionBench(tmp_path, monkeypatch, text).run_ready(body)
