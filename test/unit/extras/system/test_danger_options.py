# SPDX-License-Identifier: GPL-3.0-or-later
"""[danger_options]: that each of its options does what its name says."""
import logging

import pytest
from motion_bench import MotionBench
from motion_machine import PRINTER
from outputs_bench import OutputsBench

from klippy import dangers
from klippy.mcu import trigger_dispatch
from klippy.record import replace

HEADER = "\n[danger_options]\n"
SENSORS = """
[heater_generic block]
heater_pin: PB4
sensor_type: Generic 3950
sensor_pin: PK5
control: watermark
min_temp: 0
max_temp: 200
[temperature_sensor room]
sensor_type: Generic 3950
sensor_pin: PK6
min_temp: 0
max_temp: 90
"""


def start(tmp_path, monkeypatch, options, config="", body=lambda it: None):
    """The bench of a printer that was ready, ran body, and has ended."""
    bench = OutputsBench(tmp_path, monkeypatch, HEADER + options + config)
    bench.run_ready(body)
    return bench


def test_defaults_are_those_without_the_section(tmp_path, monkeypatch):
    def body(it):
        made = it.printer.lookup_object("danger_options")
        times = {name: None for name, value in vars(dangers._NONE).items()
                 if value is None}
        assert replace(made, **times) == dangers._NONE
        assert {name: getattr(made, name) for name in times} == {
            "single_mcu_trsync_timeout": 0.25, "multi_mcu_trsync_timeout": 0.025,
            "homing_start_delay": 0.001, "endstop_sample_time": 0.000015,
            "endstop_sample_count": 4}
    start(tmp_path, monkeypatch, "", body=body)


def test_unused_options_become_warnings(tmp_path, monkeypatch):
    def body(it):
        texts = [entry["message"] for entry in it.get("configfile")["warnings"]]
        assert any("has no option 'colour'" in text for text in texts)
        assert any("there is no section kind [nobody]" in text for text in texts)
    start(tmp_path, monkeypatch, "error_on_unused_config_options: False\n",
          "[output_pin a]\npin: PA1\ncolour: 1\n[nobody]\nx: 1\n", body)


@pytest.mark.parametrize("options, is_logged", [
    ("", True), ("log_config_file_at_startup: 0\nlog_startup_info: 0", False),
    ("minimal_logging: True", False)])
def test_the_start_is_logged(tmp_path, monkeypatch, caplog, options, is_logged):
    caplog.set_level(logging.INFO)
    start(tmp_path, monkeypatch, options + "\n",
          body=lambda it: it.printer.lookup_object("configfile").log_config(None))
    assert ("===== Config" in caplog.text) == is_logged
    assert ("constants: " in caplog.text) == is_logged


@pytest.mark.parametrize("options, is_logged", [
    ("", True), ("log_statistics: False", False)])
def test_statistics_are_logged(tmp_path, monkeypatch, caplog, options, is_logged):
    caplog.set_level(logging.INFO)
    start(tmp_path, monkeypatch, options, "\n[statistics]\n" + SENSORS,
          lambda it: (it.send("SET_HEATER_TEMPERATURE HEATER=block TARGET=60"),
                      it.pause(5.)))
    assert ("Stats " in caplog.text) == is_logged


@pytest.mark.parametrize("options, is_logged", [
    ("", True), ("log_velocity_limit_changes: False\n"
                 "log_pressure_advance_changes: False\nlog_shutdown_info: 0", False)])
def test_changes_and_shutdowns_are_logged(tmp_path, monkeypatch, caplog, options,
                                          is_logged):
    def body(it):
        caplog.clear()
        it.send("SET_VELOCITY_LIMIT ACCEL=1234\nSET_PRESSURE_ADVANCE ADVANCE=0.0123")
        it.printer.invoke_shutdown("it is a test")
        it.pause(0.5)
    caplog.set_level(logging.INFO)
    MotionBench(tmp_path, monkeypatch, PRINTER + HEADER + options).run_ready(body)
    for text in ("max_accel: 1234", "pressure_advance: 0.0123", "received 93",
                 "motion around the shutdown"):
        assert (text in caplog.text) == is_logged, text


@pytest.mark.parametrize("option", ["temp_ignore_limits", "adc_ignore_limits"])
def test_limits_of_sensors_that_heat_nothing(tmp_path, monkeypatch, option):
    def body(it):
        it.pause(2.0)
        it.machine.thermal.inputs.clear()
        mcu = it.machine.mcus["mcu"]
        mcu.set_adc(it.machine.pins.lookup("PK6").number, 0.01)
        it.pause(5.0)
        assert not it.printer.is_shutdown()
        assert it.get("temperature_sensor room")["temperature"] > 90.
        mcu.set_adc(it.machine.pins.lookup("PK5").number, 0.01)
        it.pause(5.0)
        assert it.printer.is_shutdown()
    OutputsBench(tmp_path, monkeypatch,
                 HEADER + option + ": True\n" + SENSORS).run(body)


def test_homing(tmp_path, monkeypatch):
    def body(it):
        endstop = it.toolhead.get_kinematics().rails[0].get_endstops()[0][0]
        calls, start_homing = [], endstop.home_start

        def watch(print_time, sample_time, sample_count, rest_time, triggered=True):
            calls.append((print_time, sample_time, sample_count))
            return start_homing(print_time, sample_time, sample_count, rest_time,
                                triggered=triggered)
        endstop.home_start, dwells, dwell = watch, [], it.toolhead.dwell
        it.toolhead.dwell = lambda delay: (dwells.append(delay), dwell(delay))
        it.send("G28 X")
        assert [call[1:] for call in calls] == [(0.00003, 2)] * 2
        assert [dwell for dwell in dwells if dwell] == [0.05, 0.05]
        assert trigger_dispatch.current_timeout(it.printer, 1) == 0.4
        assert trigger_dispatch.current_timeout(it.printer, 2) == 0.06
    MotionBench(tmp_path, monkeypatch, PRINTER + HEADER + (
        "endstop_sample_time: 0.00003\nendstop_sample_count: 2\n"
        "homing_start_delay: 0.05\nsingle_mcu_trsync_timeout: 0.4\n"
        "multi_mcu_trsync_timeout: 0.06\n")).run_ready(body)


def test_longest_smooth_time(tmp_path, monkeypatch):
    config = PRINTER + "pressure_advance_smooth_time: 0.25\n" + HEADER
    MotionBench(tmp_path, monkeypatch, config + (
        "override_pressure_advance_smooth_time_max: 0.3\n")).run_ready(
            lambda it: it.send("SET_PRESSURE_ADVANCE SMOOTH_TIME=0.3"))

    def refuse(it):
        assert it.printer.state == "error"
        assert "at most 0.2" in it.printer.state_message
    MotionBench(tmp_path, monkeypatch, config).run(refuse)


def test_what_is_accepted_only(tmp_path, monkeypatch):
    start(tmp_path, monkeypatch, "allow_plugin_override: True\n"
          "bgflush_extra_time: 0.1\nlog_bed_mesh_at_startup: False\n")


def test_an_error_of_the_section_is_told_once(tmp_path, monkeypatch):
    def body(it):
        assert it.printer.state == "error"
        assert it.printer.state_message.count("endstop_sample_count") == 1
        assert "printer.cfg:10" in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, HEADER + "endstop_sample_count: 0\n").run(body)


def test_included_files_after_a_save(tmp_path, monkeypatch):
    more = tmp_path / "more.cfg"
    more.write_text("[output_pin a]\npin: PA1\nvalue: 1\n")

    def body(it):
        it.printer.lookup_object("configfile").save.set("output_pin a", "value", "0")
        it.send("SAVE_CONFIG RESTART=0")
        assert more.read_text() == "[output_pin a]\npin: PA1\n#value: 1\n"
    start(tmp_path, monkeypatch, "autosave_includes: True\n[include more.cfg]\n",
          body=body)
