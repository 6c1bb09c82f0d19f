# SPDX-License-Identifier: GPL-3.0-or-later
"""[filament_switch_sensor] in prints that run out of filament."""
import pytest
from filament_bench import FilamentBench

SENSOR = """
[filament_switch_sensor runout]
switch_pin: ^!PG1
runout_gcode: RESPOND MSG="ran out"
insert_gcode: RESPOND MSG="put in"
%s
[simulator]
filament_length: extruder=%s
"""


def run(tmp_path, monkeypatch, body, more="", length=30):
    FilamentBench(tmp_path, monkeypatch, SENSOR % (more, length)).run_ready(body)


def test_print_pauses_and_goes_on(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        assert it.get("filament_switch_sensor runout")["filament_detected"]
        it.start_job()
        assert it.wait_state("paused", "complete") == "paused"
        it.pause(2.0)
        # the plan ahead of the runout is printed: less than 2 s of it
        assert 30.0 <= it.spool.pushed < 30.0 + 2 * 1.6 + 0.8
        assert it.count("ran out") == 1
        assert it.get("pause_resume") == {"is_paused": True}
        assert it.get("filament_switch_sensor runout")["filament_detected"] is False
        it.send("QUERY_FILAMENT_SENSOR SENSOR=runout")
        assert it.output[-1] == "// Filament Sensor runout: filament not detected"
        it.pause(20.0)
        it.spool.load()
        it.pause(1.0)
        assert it.count("put in") == 1
        it.send("QUERY_FILAMENT_SENSOR SENSOR=runout")
        assert it.output[-1] == "// Filament Sensor runout: filament detected"
        it.send("RESUME")
        it.pause(1.0)
        assert it.wait_state("complete", "paused") == "complete"
        it.toolhead.wait_moves()
        it.pause(1.0)
        assert it.spool.pushed == pytest.approx(80.0, abs=0.02)
        assert it.count("ran out") == 1
    run(tmp_path, monkeypatch, body)


def test_events_wait_after_a_script(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        for present in (False, True):        # 1 s apart: less than event_delay
            it.spool.load(1e9 if present else 0.0)
            it.pause(1.0)
        assert it.count("put in") == 1
        it.spool.load(0.0)
        it.pause(1.0)
        it.spool.load()
        it.pause(1.0)
        assert it.count("put in") == 1
        it.pause(4.0)
        it.spool.load(0.0)
        it.pause(0.5)
        it.spool.load()
        it.pause(0.5)
        assert it.count("put in") == 2
    run(tmp_path, monkeypatch, body, "event_delay: 4", 1e9)


def test_no_events_in_the_first_seconds(tmp_path, monkeypatch):
    def body(it):
        it.spool.load()
        it.pause(1.7)
        assert it.get("filament_switch_sensor runout")["filament_detected"]
        assert it.count("put in") == 0
    run(tmp_path, monkeypatch, body, length=0)


def test_turned_off(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.send("SET_FILAMENT_SENSOR SENSOR=runout ENABLE=0")
        it.start_job(50)
        assert it.wait_state("complete", "paused") == "complete"
        status = it.get("filament_switch_sensor runout")
        assert not status["enabled"] and not status["filament_detected"]
        it.send("SET_FILAMENT_SENSOR SENSOR=runout")
        assert it.get("filament_switch_sensor runout")["enabled"]
    run(tmp_path, monkeypatch, body)


def test_without_pause_only_the_script_runs(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.start_job(60)
        assert it.wait_state("complete", "paused") == "complete"
        assert it.count("ran out") == 1
    run(tmp_path, monkeypatch, body, "pause_on_runout: False")


def test_switch_that_bounces_is_no_runout(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.start_job(60)
        it.pause(10.0)
        for _ in range(4):
            it.spool.load(0.0)
            it.pause(0.05)
            it.spool.load()
            it.pause(0.2)
        assert it.wait_state("complete", "paused") == "complete"
        assert it.count("ran out") == 0
    run(tmp_path, monkeypatch, body, "debounce_delay: 0.3", 1e9)


def test_rest_behind_the_sensor_is_used_up(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.start_job()
        while it.get("filament_switch_sensor runout")["filament_detected"]:
            it.pause(0.05)
        it.pause(3.0)
        assert it.state == "printing" and it.count("at once") == 1
        elapsed = it.get("filament_switch_sensor runout")["runout_elapsed"]
        assert elapsed == pytest.approx(3.05 * 1.6, abs=0.3)
        assert it.wait_state("paused", "complete") == "paused"
        it.pause(2.0)
        assert 50.0 <= it.spool.pushed < 50.0 + 2 * 1.6 + 0.8
        assert it.count("ran out") == 1
        assert it.get("filament_switch_sensor runout")["runout_elapsed"] == 0.0
    run(tmp_path, monkeypatch, body,
        "runout_distance: 20\nimmediate_runout_gcode: RESPOND MSG='at once'")


def test_reset_forgets_a_runout(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.start_job(70)
        while it.get("filament_switch_sensor runout")["filament_detected"]:
            it.pause(0.05)
        it.pause(1.0)
        it.printer.lookup_object("filament_switch_sensor runout")
        helper = it.printer.lookup_object("filament_switch_sensor runout").runout_helper
        assert helper.runout_start is not None
        it.printer.lookup_object("gcode").run_script(
            "SET_FILAMENT_SENSOR SENSOR=runout RESET=1")
        assert it.wait_state("complete", "paused") == "complete"
        assert it.count("ran out") == 0
    run(tmp_path, monkeypatch, body, "runout_distance: 20")


def test_print_does_not_start_without_filament(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.start_job(30)
        assert it.wait_state("complete", "paused") == "paused"
        assert it.spool.pushed < 5.0
    run(tmp_path, monkeypatch, body, "check_on_print_start: True", 0)


def test_smart_ignores_moves_by_hand(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.send("G28\nM83\nG1 E35 F300\nG4 P500")
        it.pause(1.0)
        assert it.count("ran out") == 0
        it.pause(30.0)
        it.spool.load(10.0)
        it.pause(5.0)
        it.start_job(40)
        assert it.wait_state("complete", "paused") == "paused"
        it.pause(2.0)
        assert it.count("ran out") == 1
    run(tmp_path, monkeypatch, body, "smart: True")


def test_printer_events(tmp_path, monkeypatch):
    def body(it):
        seen = []
        for kind in ("insert", "runout"):
            it.printer.register_event_handler(
                "filament:" + kind,
                lambda eventtime, name, kind=kind: seen.append((kind, name)))
        it.pause(3.0)
        it.spool.load(0.0)
        it.pause(0.5)
        it.send("SET_FILAMENT_SENSOR SENSOR=runout ENABLE=0")
        it.spool.load()
        it.pause(0.5)
        assert seen == [("runout", "runout")]
        it.send("SET_FILAMENT_SENSOR SENSOR=runout ALWAYS_FIRE_EVENTS=1")
        it.spool.load(0.0)
        it.pause(0.5)
        assert seen == [("runout", "runout")] * 2
        status = it.get("filament_switch_sensor runout")
        assert status["always_fire_events"] and not status["enabled"]
    run(tmp_path, monkeypatch, body, length=1e9)


def test_error_in_a_script_is_told(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.start_job()
        it.wait_state("paused")
        it.pause(2.0)
        assert it.count("!! Filament sensor runout: ") == 1
        assert it.get("pause_resume")["is_paused"] and not it.printer.is_shutdown()
    FilamentBench(tmp_path, monkeypatch, (SENSOR % ("", 30)).replace(
        'RESPOND MSG="ran out"', "G1 X999")).run_ready(body)


def test_options_by_command(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.send("SET_FILAMENT_SENSOR SENSOR=runout SMART=1 RUNOUT_DISTANCE=12.5"
                " CHECK_ON_PRINT_START=1")
        status = it.get("filament_switch_sensor runout")
        assert status == {
            "filament_detected": True, "enabled": True, "smart": True,
            "always_fire_events": False, "runout_distance": 12.5,
            "runout_elapsed": 0.0, "check_on_print_start": True}
        for bad in ("RUNOUT_DISTANCE=-1", "SMART=2", "ENABLE=x"):
            with pytest.raises(it.printer.command_error):
                it.send("SET_FILAMENT_SENSOR SENSOR=runout " + bad)
    run(tmp_path, monkeypatch, body)
