# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits of heaters and moves that commands change, and what brings them back."""
import pytest
from motion_bench import MotionBench
from motion_machine import PRINTER, filament

from klippy.errors import CommandError

PID = PRINTER.replace("min_extrude_temp: 0", "min_extrude_temp: 170").replace(
    "control: watermark", "control: pid\npid_kp: 22.2\npid_ki: 1.08\npid_kd: 114\n"
    "pid_version: 1\npid_target: 200\npid_tolerance: 0.02")


@pytest.fixture
def run(tmp_path, monkeypatch):
    return MotionBench(tmp_path, monkeypatch, PID).run_ready


def refuse(it, script):
    with pytest.raises(CommandError):
        it.send(script)
    it.output.clear()


@pytest.mark.parametrize("allow, forbid", [
    ("COLD_EXTRUDE HEATER=extruder ENABLE=1", "COLD_EXTRUDE HEATER=extruder ENABLE=0"),
    ("M302 P1", "M302 T0 P0"), ("M302 S0", "M302 S170"),
    ("COLD_EXTRUDE HEATER=extruder MIN_EXTRUDE_TEMP=5",
     "COLD_EXTRUDE HEATER=extruder MIN_EXTRUDE_TEMP=200")])
def test_cold_extrusion(run, allow, forbid):
    def body(it):
        it.pause(3.)        # a reading or two
        refuse(it, "G1 E5 F300")
        it.send(allow)
        assert it.get("extruder")["can_extrude"]
        it.pause(2.)
        it.send("G1 E5 F300")
        assert filament(it) == pytest.approx(5., abs=0.02)
        it.send(forbid)
        refuse(it, "G1 E6 F300")
        it.send("M302")
        assert "cold extrusion is off" in it.output[-1]
    run(body)


def test_limits_are_checked(run):
    def body(it):
        for line in ("M302 T7", "M302 S400", "M302 P2", "COLD_EXTRUDE HEATER=none",
                     "COLD_EXTRUDE HEATER=extruder MIN_EXTRUDE_TEMP=-5"):
            refuse(it, line)
    run(body)


def test_smooth_time(run):
    def body(it):
        heater = it.printer.lookup_object("heaters").lookup_heater("extruder")
        it.send("SET_SMOOTH_TIME HEATER=extruder SMOOTH_TIME=2.5")
        assert heater.get_smooth_time() == heater.control.min_deriv_time == 2.5
        it.send("SET_HEATER_PID HEATER=extruder KP=20")
        assert heater.control.min_deriv_time == 2.5
        assert not it.get("configfile")["save_config_pending"]
        it.send("SET_SMOOTH_TIME HEATER=extruder")
        assert heater.get_smooth_time() == 1.
        it.send("SET_SMOOTH_TIME HEATER=extruder SMOOTH_TIME=0\n"
                "M104 S100")
        it.pause(3.)
        assert heater.smoothed_temp == heater.last_temp
    run(body)


def test_smooth_time_of_a_profile(run):
    def body(it):
        it.send("PID_PROFILE SAVE=fast HEATER=extruder\n"
                "SET_SMOOTH_TIME HEATER=extruder SMOOTH_TIME=0.5 SAVE_TO_PROFILE=1")
        pending = it.get("configfile")["save_config_pending_items"]
        assert pending["pid_profile extruder fast"]["smooth_time"] == "0.500"
    run(body)


def test_velocity_limits_come_back(run):
    def body(it):
        before = it.get("toolhead")
        it.send("SET_VELOCITY_LIMIT VELOCITY=50 ACCEL=500 SQUARE_CORNER_VELOCITY=1"
                " MINIMUM_CRUISE_RATIO=0.1")
        it.send("M204 S300")
        assert it.get("toolhead")["max_accel"] == 300
        it.send("RESET_VELOCITY_LIMIT")
        after = it.get("toolhead")
        for name in ("max_velocity", "max_accel", "square_corner_velocity",
                     "minimum_cruise_ratio"):
            assert after[name] == before[name]
        assert "max_accel: 3000" in it.output[-1]
    run(body)


@pytest.mark.parametrize("kinematics", ["cartesian", "limited_cartesian"])
def test_velocity_limits_of_axes(tmp_path, monkeypatch, kinematics):
    def body(it):
        it.send("SET_VELOCITY_LIMIT Z_VELOCITY=7 Z_ACCEL=77 X_VELOCITY=33 Y_ACCEL=444")
        limits = it.toolhead.get_kinematics().limits
        assert (limits.max_z_velocity, limits.max_z_accel) == (7, 77)
        if kinematics != "cartesian":
            status = it.get("toolhead")
            assert (status["max_x_velocity"], status["max_y_velocity"]) == (33, 300)
            assert (status["max_x_accel"], status["max_y_accel"]) == (3000, 444)
    MotionBench(tmp_path, monkeypatch, PRINTER.replace(
        "kinematics: cartesian", "kinematics: " + kinematics)).run_ready(body)


def test_all_motors_at_once(run):
    def body(it):
        it.send("SET_STEPPER_ENABLE ENABLE=1")
        assert set(it.get("stepper_enable")["steppers"].values()) == {True}
        it.send("SET_STEPPER_ENABLE ENABLE=0")
        assert set(it.get("stepper_enable")["steppers"].values()) == {False}
    run(body)
