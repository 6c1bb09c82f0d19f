# SPDX-License-Identifier: GPL-3.0-or-later
import motion_machine
import pytest
from motion_bench import CARTESIAN
from motion_machine import EXTRUDER, count, filament

from klippy.errors import CommandError

SECOND = (EXTRUDER % "extruder1").replace("PA4", "PA0").replace("PA6", "PA2").replace(
    "PB4", "PB5").replace("PK5", "PK6")
MOTOR = """
[extruder_stepper %s]
extruder: %s
step_pin: P%s0
dir_pin: P%s1
microsteps: 16
rotation_distance: 32
"""
SHARED = """
[extruder1]
step_pin: PA0
dir_pin: PA2
microsteps: 16
rotation_distance: 32
nozzle_diameter: 0.4
filament_diameter: 1.75
shared_heater: extruder
"""
START = "G28\nG90\nM83\nG1 X50 Y50 Z5 F6000\n"


@pytest.fixture
def run(tmp_path, monkeypatch):
    return motion_machine.make_run(tmp_path, monkeypatch)


def near(value):
    return pytest.approx(value, abs=0.006)


def test_each_extruder_has_its_own_axis(run):
    def body(it):
        it.send(START + "M82\nG92 E0\nG1 E2\nACTIVATE_EXTRUDER EXTRUDER=extruder1")
        assert it.get("toolhead")["extruder"] == "extruder1"
        it.send("G92 E0\nG1 X60 E0.4\nG1 X50 E1")
        assert (filament(it), filament(it, "extruder1")) == (near(2.), near(1.))
        it.send("ACTIVATE_EXTRUDER EXTRUDER=extruder1")
        assert it.output[-1] == "// Extruder extruder1 already active"
        it.send("M221 S50\nACTIVATE_EXTRUDER EXTRUDER=extruder\nG92 E0\nG1 E1")
        assert it.get("gcode_move")["extrude_factor"] == 1.
        assert (filament(it), filament(it, "extruder1")) == (near(3.), near(1.))
        assert it.toolhead.get_position()[3] == near(3.)
    run(body, SECOND)


def test_tools_by_number(run):
    def body(it):
        events = []
        it.printer.register_event_handler("extruder:activate_extruder",
                                          lambda: events.append(1))
        it.send(START + "T1\nG1 E1\nT0\nG1 E-1\nT0")
        assert (filament(it), filament(it, "extruder1")) == (near(-1.), near(1.))
        assert len(events) == 2
        it.send("T2")
        assert it.output[-1] == '// Unknown command:"T2"'
    run(body, SECOND)


def test_macros_for_tools_come_first(run):
    def body(it):
        it.send("T1")
        assert it.get("toolhead")["extruder"] == "extruder"
    run(body, SECOND + "[gcode_macro T1]\ngcode: M117 no\n")


def test_retraction_of_each_extruder(run):
    def body(it):
        it.send(START + "G10\nT1\nG11\nG10\nT0\nG11\nG11")
        assert (filament(it), filament(it, "extruder1")) == (near(0.), near(-2.))
        it.send("T1\nG11")
        assert filament(it, "extruder1") == near(0.)
    run(body, SECOND + "[firmware_retraction]\nretract_length: 2\n")


def test_motors_follow_whom_they_are_told_to(run):
    def body(it):
        it.send(START + "G1 E1")
        assert filament(it, "extruder_stepper a") == near(1.)
        assert it.get("extruder_stepper a")["motion_queue"] == "extruder"
        it.send("T1\nG1 E2\nSYNC_EXTRUDER_MOTION EXTRUDER=a MOTION_QUEUE=extruder1\n"
                "SYNC_EXTRUDER_MOTION EXTRUDER=extruder MOTION_QUEUE=extruder1\nG1 E3")
        steps = [filament(it, name) for name in ("extruder_stepper a", "extruder",
                                                 "extruder1")]
        assert steps == [near(4.), near(4.), near(5.)]
        it.send("SYNC_EXTRUDER_MOTION EXTRUDER=a MOTION_QUEUE=\nG1 E1 X60")
        steps = [filament(it, name) for name in ("extruder_stepper a", "extruder",
                                                 "extruder1")]
        assert steps == [near(4.), near(5.), near(6.)]
        assert it.get("extruder_stepper a")["motion_queue"] is None
        assert it.get("extruder")["motion_queue"] == "extruder1"
        for name in ("toolhead", "extruder2"):
            with pytest.raises(CommandError, match="not a valid extruder"):
                it.send("SYNC_EXTRUDER_MOTION EXTRUDER=a MOTION_QUEUE=" + name)
    run(body, SECOND + MOTOR % ("a", "extruder", "C", "C"))


def test_extruder_without_a_motor(tmp_path, monkeypatch):
    """All motors are sections of their own."""
    def body(it):
        it.send(START + "G1 E1")
        assert filament(it, "extruder_stepper a") == near(1.)
        with pytest.raises(CommandError, match="EXTRUDER is missing"):
            it.send("SET_PRESSURE_ADVANCE ADVANCE=0.1")
        it.send("SET_PRESSURE_ADVANCE EXTRUDER=a ADVANCE=0.1")
        assert "pressure_advance" not in it.get("extruder")
        assert it.get("extruder_stepper a")["pressure_advance"] == 0.1
    drive = ("step_pin", "dir_pin", "microsteps", "rotation_distance")
    bare = "\n".join(line for line in (EXTRUDER % "extruder").splitlines()
                     if line.split(":")[0] not in drive)
    motion_machine.make_run(tmp_path, monkeypatch, CARTESIAN)(
        body, bare + "\n" + MOTOR % ("a", "extruder", "C", "C"))


def test_rotation_distance(run):
    def body(it):
        it.send(START + "SET_EXTRUDER_ROTATION_DISTANCE EXTRUDER=extruder DISTANCE=16"
                "\nG1 E1")
        assert count(it) == 200
        it.send("SET_EXTRUDER_ROTATION_DISTANCE EXTRUDER=extruder DISTANCE=-32\nG1 E1")
        assert count(it) == 100
        it.send("SET_EXTRUDER_ROTATION_DISTANCE EXTRUDER=extruder")
        assert it.output[-1] == (
            "// Extruder 'extruder' rotation distance set to -32.000000")
        with pytest.raises(CommandError, match="can not be zero"):
            it.send("SET_EXTRUDER_ROTATION_DISTANCE EXTRUDER=extruder DISTANCE=0")
    run(body)


def test_shared_heater(run):
    def body(it):
        it.send("M104 T1 S60")
        assert it.get("extruder")["target"] == 60. == it.get("extruder1")["target"]
        assert it.get("heaters")["available_heaters"] == ["extruder"]
        it.send("T1\nM109 S50\n" + START + "G1 E1")
        assert it.get("extruder1")["temperature"] >= 49.
        assert filament(it, "extruder1") == near(1.)
        it.send("M105")
        assert it.output[-1].startswith("T0:") and "T1:" not in it.output[-1]
    run(body, SHARED)


def test_shared_heater_that_is_not_there(tmp_path, monkeypatch):
    import motion_bench

    def body(it):
        assert "Unknown heater 'bed1'" in it.printer.state_message
    config = motion_machine.PRINTER + SHARED.replace("r: extruder", "r: bed1")
    motion_bench.MotionBench(tmp_path, monkeypatch, config).run(body)


CURVED = """
pressure_advance_model: reciprocal
linear_advance: 0.02
nonlinear_offset: 0.3
linearization_velocity: 4
pressure_advance_time_offset: 0.01
pressure_advance_smooth_time: 0.03
"""


def test_options_of_pressure_advance(run):
    def body(it):
        assert it.get("extruder") | {
            "pressure_advance": 0.02, "smooth_time": 0.03, "nonlinear_offset": 0.3,
            "pressure_advance_model": "recipr", "linearization_velocity": 4.,
            "time_offset": 0.01} == it.get("extruder")
        reach = it.printer.lookup_object("motion_queuing").get_kin_flush_delay()
        assert reach == pytest.approx(0.025)
        it.send("SET_PRESSURE_ADVANCE TIME_OFFSET=0 MODEL=tanh OFFSET=0.1 VELOCITY=2")
        assert it.output[-1] == (
            "// pressure_advance: 0.020000\n// pressure_advance_smooth_time: 0.030000\n"
            "// pressure_advance_model: tanh\n// nonlinear_offset: 0.100000\n"
            "// linearization_velocity: 2.000000")
        it.send("SET_PRESSURE_ADVANCE ADVANCE=0.05 MODEL=LINEAR SMOOTH_TIME=0.04")
        assert it.output[-1] == ("// pressure_advance: 0.050000\n"
                                 "// pressure_advance_smooth_time: 0.040000")
        kept = it.get("extruder")
        for wrong in ("MODEL=cubic", "OFFSET=-1", "TIME_OFFSET=0.21", "ADVANCE=-1",
                      "SMOOTH_TIME=0.21", "MODEL=tanh VELOCITY=0"):
            with pytest.raises(CommandError):
                it.send("SET_PRESSURE_ADVANCE " + wrong)
        assert it.get("extruder") == kept
    run(body, CURVED)


def test_curve_without_speed(tmp_path, monkeypatch):
    import motion_bench

    def body(it):
        assert "linearization_velocity" in it.printer.state_message
    motion_bench.MotionBench(
        tmp_path, monkeypatch, motion_machine.PRINTER
        + "pressure_advance_model: tanh\nnonlinear_offset: 0.1\n").run(body)


def test_steps_of_a_changing_model(run):
    """Whatever is set in the middle of moves: in the end nothing is lost."""
    def body(it):
        it.send(START)
        for i in range(40):
            it.send("SET_PRESSURE_ADVANCE ADVANCE=0.0%d MODEL=%s OFFSET=0.%d VELOCITY=3"
                    " TIME_OFFSET=%.3f SMOOTH_TIME=0.0%d\nG1 X%g E0.4 F3000" % (
                        i % 7, ("tanh", "recipr", "linear")[i % 3], i % 4,
                        0.01 * (i % 5) - 0.02, 1 + i % 5, 60. + i % 2 * 15.))
        assert filament(it) == near(16.)
        assert max(it.get_error()) < 0.0063
    run(body)
