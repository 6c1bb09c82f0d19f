# SPDX-License-Identifier: GPL-3.0-or-later
import math

import motion_machine
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError
from klippy.extras.skew_correction import Skew, calc_factor

LOAD = """
[skew_correction]
[skew_correction leaning]
xy_skew: 0.01
xz_skew: -0.02
yz_skew: 0.03
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    return motion_machine.make_run(tmp_path, monkeypatch, CARTESIAN)


def bend(point, skew):
    """Where a machine with a skew puts the nozzle."""
    x, y, z = point
    return (x + skew.xy * y + skew.xz * z, y + skew.yz * z, z)


@pytest.mark.parametrize("skew", [Skew(), Skew(0.01, 0., 0.), Skew(-.02, .03, .015)])
def test_corrected_moves_end_where_they_should(skew):
    goal = [37., 61., 12., 5., 6.]
    sent = skew.correct(goal)
    assert bend(sent[:3], skew) == pytest.approx(goal[:3])
    assert skew.uncorrect(sent) == pytest.approx(goal)
    assert sent[3:] == goal[3:]


@pytest.mark.parametrize("factor", [0., 0.004, -0.01])
@pytest.mark.parametrize("side, other", [(100., 100.), (100., 80.)])
def test_factor_of_a_measured_print(factor, side, other):
    a, b = (0., 0.), (factor * other, other)
    c, d = (side + factor * other, other), (side, 0.)
    measured = math.dist(a, c), math.dist(b, d), math.dist(a, d)
    assert calc_factor(*measured) == pytest.approx(factor, abs=1e-12)


@pytest.mark.parametrize("lengths", [(10., 10., 100.), (100., 1., 1.)])
def test_impossible_squares(lengths):
    with pytest.raises(ValueError, match="no square"):
        calc_factor(*lengths)


def test_the_head_goes_aslant(run):
    skew = Skew(0.01, -0.02, 0.03)

    def body(it):
        it.send("G28\nG90\nG1 X100 Y100 Z10 F6000")
        assert it.machine.calc_position() != pytest.approx(
            skew.correct((100., 100., 10.)), abs=0.1)
        it.send("SKEW_PROFILE LOAD=leaning")
        # where the head is now is another place in the corrected coordinates
        assert it.get("gcode_move")["position"][:3] == pytest.approx(
            bend((100., 100., 10.), skew))
        it.send("G1 X120 Y80 Z15")
        assert max(it.get_error()) < 0.0063
        assert bend(it.machine.calc_position(), skew) == pytest.approx(
            (120., 80., 15.), abs=0.013)
        it.send("SET_SKEW CLEAR=1\nG1 X120 Y80 Z15")
        it.toolhead.wait_moves()
        it.pause(0.5)
        assert it.machine.calc_position() == pytest.approx(
            (120., 80., 15.), abs=0.013)
    run(body, LOAD)


def test_transforms_stay_in_line(run):
    """Objects that are left out end where they should, too."""
    def body(it):
        it.send("G28\nSET_SKEW XY=141.8,141,100\nG1 X50 Y60 Z5 F6000\n"
                "EXCLUDE_OBJECT NAME=a\nEXCLUDE_OBJECT_START NAME=a\nG1 X90\n"
                "EXCLUDE_OBJECT_END\nG1 X80 Y40")
        assert max(it.get_error()) < 0.0063
        factor = calc_factor(141.8, 141., 100.)
        assert it.machine.calc_position()[:2] == pytest.approx(
            (80. - 40. * factor, 40.), abs=0.013)
    run(body, LOAD + "[exclude_object]\n")


def test_commands(run):
    def body(it):
        it.send("SET_SKEW XY=141.8,141,100 YZ=141,141.8,100\nGET_CURRENT_SKEW")
        assert it.output[-1] == (
            "// Current Printer Skew:\n// XY Skew: 0.005658 radians, 0.32 degrees\n"
            "// XZ Skew: 0.000000 radians, 0.00 degrees\n"
            "// YZ Skew: -0.005658 radians, -0.32 degrees")
        it.send("SET_SKEW XZ=141.8,141,100\nGET_CURRENT_SKEW")
        assert it.output[-1].count("0.005658") == 3
        it.send("CALC_MEASURED_SKEW AC=141.8 BD=141 AD=100")
        assert it.output[-1] == "// Calculated Skew: 0.005658 radians, 0.32 degrees"
        assert it.get("skew_correction") == {"current_profile_name": ""}
    run(body, LOAD)


def test_profiles(run):
    def body(it):
        def profile():
            return it.get("skew_correction")["current_profile_name"]
        it.send("SKEW_PROFILE LOAD=leaning")
        assert profile() == "leaning"
        it.send("SET_SKEW XY=100,100,70.7")
        assert profile() == ""
        it.send("SKEW_PROFILE SAVE=new\nSKEW_PROFILE REMOVE=leaning")
        pending = it.get("configfile")["save_config_pending_items"]
        assert pending["skew_correction new"] == {
            "xy_skew": "0.000000000", "xz_skew": "-0.020000000",
            "yz_skew": "0.030000000"}
        with pytest.raises(CommandError, match="no skew profile 'leaning', only new"):
            it.send("SKEW_PROFILE LOAD=leaning")
        it.send("SET_SKEW CLEAR=1\nSKEW_PROFILE LOAD=new")
        assert profile() == "new"
    run(body, LOAD)


@pytest.mark.parametrize("line", [
    "SET_SKEW XY=1,2", "SET_SKEW XY=141,141,x", "SET_SKEW XZ=141,141,-5",
    "SET_SKEW YZ=10,10,100", "CALC_MEASURED_SKEW AC=141 BD=141",
    "CALC_MEASURED_SKEW AC=1 BD=1 AD=0", "SKEW_PROFILE", "SKEW_PROFILE REMOVE=x",
    "SKEW_PROFILE LOAD=leaning SAVE=b", "SKEW_PROFILE SAVE="])
def test_wrong_parameters(run, line):
    def body(it):
        with pytest.raises(CommandError):
            it.send(line)
        assert it.printer.lookup_object("skew_correction").skew == Skew()
    run(body, LOAD)
