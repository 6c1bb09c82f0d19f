# SPDX-License-Identifier: GPL-3.0-or-later
import motion_machine
import pytest
from motion_bench import CARTESIAN

from klippy.errors import CommandError
from klippy.extras.z_thermal_adjust import SmoothedSensor

FRAME = """
[z_thermal_adjust]
temp_coeff: 0.01
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PK6
min_temp: 0
max_temp: 100
z_adjust_off_above: 20
max_z_adjustment: 0.3
gcode_id: F
"""
# mm: the half steps of two roundings, and 0.2 degC
Z_ERROR = 8. / 3200. + 0.002
START = "G28\nG90\nG1 X50 Y50 Z5 F6000\n"


@pytest.fixture
def run(tmp_path, monkeypatch):
    return motion_machine.make_run(tmp_path, monkeypatch, CARTESIAN)


def heat(it, temperature):
    """The frame gets warm or cold, and stays so."""
    for analog in it.machine.thermal.inputs:
        analog.ambient = temperature
    it.pause(20.)


def true_z(it):
    assert max(it.get_error()) < 0.0063
    return it.machine.calc_position()[2]


def status(it):
    return it.get("z_thermal_adjust")


def test_smoothing():
    readings = SmoothedSensor(2.)
    for time, temp in ((1., 0.), (2., 20.), (2.5, 40.), (3., 40.), (9., 30.)):
        readings.note(time, temp)
    # a quarter of 20 degC, then of the 15 left, then long enough for all
    assert readings.mean == 30. and readings.last == 30.
    assert readings.extremes == (20., pytest.approx(30.))
    readings = SmoothedSensor(2.)
    for time, temp in ((2., 20.), (2.5, 40.), (3., 40.)):
        readings.note(time, temp)
    assert readings.mean == pytest.approx(28.75)


def test_the_head_goes_down_when_the_frame_grows(run):
    def body(it):
        it.pause(5.)
        it.send(START)
        assert status(it)["z_adjust_ref_temperature"] == pytest.approx(25., abs=0.2)
        assert true_z(it) == pytest.approx(5., abs=Z_ERROR)
        heat(it, 40.)
        assert status(it)["temperature"] == pytest.approx(40., abs=0.2)
        it.send("G1 X60")
        assert true_z(it) == pytest.approx(4.85, abs=Z_ERROR)
        assert status(it)["current_z_adjust"] == pytest.approx(-0.15, abs=0.002)
        assert it.get("gcode_move")["gcode_position"].z == pytest.approx(5.)
        heat(it, 15.)
        it.send("G91\nG1 Z1\nG90")
        assert true_z(it) == pytest.approx(6.1, abs=Z_ERROR)
        assert it.get("gcode_move")["gcode_position"].z == pytest.approx(6.)
    run(body, FRAME)


def test_limits(run):
    def body(it):
        it.pause(5.)
        it.send(START)
        heat(it, 75.)
        it.send("G1 X60")
        assert true_z(it) == pytest.approx(4.7, abs=Z_ERROR)
        heat(it, 35.)
        it.send("G1 Z25")           # stays as it was, up there
        assert true_z(it) == pytest.approx(24.7, abs=Z_ERROR)
        it.send("G1 Z10")
        assert true_z(it) == pytest.approx(9.9, abs=Z_ERROR)
    run(body, FRAME)


def test_homing_and_motors_off(run):
    def body(it):
        it.pause(5.)
        it.send(START)
        heat(it, 45.)
        it.send("G1 X60\nM84")
        assert status(it)["z_adjust_ref_temperature"] == 0.
        it.send("G28 X Y\nG28 Z\nG1 Z5")
        assert status(it)["current_z_adjust"] == 0.
        assert status(it)["z_adjust_ref_temperature"] == pytest.approx(45., abs=0.2)
        assert true_z(it) == pytest.approx(5., abs=Z_ERROR)
    run(body, FRAME)


def test_no_adjustment_before_homing(run):
    """Cold start far from 0 degC: an unhomed z must not be moved."""
    def body(it):
        it.pause(5.)
        it.send("G28 X Y\nG1 X20 F6000")
        assert status(it)["current_z_adjust"] == 0.
    run(body, FRAME)


def test_command(run):
    def body(it):
        it.pause(5.)
        it.send(START + "SET_Z_THERMAL_ADJUST REF_TEMP=35 TEMP_COEFF=-0.02")
        assert "ref_temp: 35.00 degC (given)" in it.output[-1]
        it.send("G1 X60")
        assert true_z(it) == pytest.approx(4.8, abs=Z_ERROR)
        it.send("SET_Z_THERMAL_ADJUST ENABLE=0")
        heat(it, 35.)
        it.send("G1 X50")
        assert true_z(it) == pytest.approx(4.8, abs=Z_ERROR)
        assert status(it)["enabled"] is False
        it.send("SET_Z_THERMAL_ADJUST ENABLE=1\nG1 X60")
        assert true_z(it) == pytest.approx(5., abs=Z_ERROR)
        for wrong in ("ENABLE=2", "TEMP_COEFF=1.5", "REF_TEMP=-300"):
            with pytest.raises(CommandError):
                it.send("SET_Z_THERMAL_ADJUST " + wrong)
    run(body, FRAME)


def test_is_a_sensor_like_others(run):
    def body(it):
        it.pause(5.)
        it.send("M105\nTEMPERATURE_WAIT SENSOR=z_thermal_adjust MINIMUM=20")
        assert any("F:24.9 /0.0" in line for line in it.output)
        assert set(status(it)) == {
            "temperature", "measured_min_temp", "measured_max_temp",
            "current_z_adjust", "z_adjust_ref_temperature", "enabled"}
    run(body, FRAME)


def test_parts_add_up(run):
    def body(it):
        it.pause(5.)
        it.send(START)
        heat(it, 45.)
        it.send("G1 X60")
        assert true_z(it) == pytest.approx(5. - 0.2 + 0.1, abs=Z_ERROR)
        it.send("SET_Z_THERMAL_ADJUST COMPONENT=bed REF_TEMP=45\n"
                "SET_Z_THERMAL_ADJUST ENABLE=0\nG1 X50")
        assert true_z(it) == pytest.approx(5. - 0.2, abs=Z_ERROR)
        assert it.get("z_thermal_adjust bed")["z_adjust_ref_temperature"] == 45.
        it.send("TEMPERATURE_WAIT SENSOR='z_thermal_adjust bed' MINIMUM=20")
    run(body, FRAME + FRAME.replace("adjust]", "adjust bed]").replace(
        "0.01", "-0.005").replace("PK6", "PK7").replace("gcode_id: F", ""))
