# SPDX-License-Identifier: GPL-3.0-or-later
"""[filament_motion_sensor]: prints with a jam, with an empty spool, and without."""
import pytest
from filament_bench import FilamentBench

SENSOR = """
[filament_motion_sensor encoder]
switch_pin: ^PG1
extruder: extruder
detection_length: 4
runout_gcode: RESPOND MSG="stuck"
[simulator]
%s
"""


def run(tmp_path, monkeypatch, body, simulator=""):
    FilamentBench(tmp_path, monkeypatch, SENSOR % (simulator,)).run_ready(body)


def test_good_print_is_not_stopped(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.start_job(60)
        assert it.wait_state("complete", "paused") == "complete"
        assert it.get("filament_motion_sensor encoder") == {
            "filament_detected": True, "enabled": True, "smart": False,
            "always_fire_events": False, "detection_length": 4.0}
    run(tmp_path, monkeypatch, body)


@pytest.mark.parametrize("fault", ["filament_jam: extruder=30",
                                   "filament_length: extruder=30"])
def test_filament_that_does_not_move(tmp_path, monkeypatch, fault):
    def body(it):
        it.pause(3.0)
        it.start_job()
        assert it.wait_state("complete", "paused") == "paused"
        it.pause(2.0)
        assert it.count("stuck") == 1
        # the last edge was up to 1.44 mm earlier; 0.25 s of a look, 2 s of plan
        assert 32.0 < it.spool.pushed < 30.0 + 4.0 + 2.25 * 1.6 + 0.8
        assert it.get("filament_motion_sensor encoder")["filament_detected"] is False
    run(tmp_path, monkeypatch, body, fault)


def test_detection_length_by_command(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.send("SET_FILAMENT_SENSOR SENSOR=encoder DETECTION_LENGTH=40")
        it.start_job(50)
        assert it.wait_state("complete", "paused") == "complete"
        assert it.get("filament_motion_sensor encoder")["detection_length"] == 40.0
    run(tmp_path, monkeypatch, body, "filament_jam: extruder=5")


def test_unknown_extruder(tmp_path, monkeypatch):
    def body(it):
        assert "there is no extruder 'extruder7'" in it.printer.state_message
    FilamentBench(tmp_path, monkeypatch, (SENSOR % "").replace(
        "extruder: extruder", "extruder: extruder7")).run(body)
