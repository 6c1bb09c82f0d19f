# SPDX-License-Identifier: GPL-3.0-or-later
"""Width sensors in prints: the flow follows filament that gets thinner."""
import pytest
from filament_bench import FilamentBench

from klippy.extras.filament_width import WidthTrack

TSL = """
[tsl1401cl_filament_width_sensor]
pin: PK1
default_nominal_filament_diameter: 1.75
measurement_delay: 20
max_difference: 0.2
"""
HALL = """
[hall_filament_width_sensor]
adc1: PK1
adc2: PK2
cal_dia1: 1.5
cal_dia2: 2.0
raw_dia1: 9000
raw_dia2: 10200
default_nominal_filament_diameter: 1.75
measurement_delay: 20
measurement_interval: 5
enable: True
pause_on_runout: True
runout_gcode: RESPOND MSG="ran out"
%s
"""


def taper(position):
    """1.75 mm for 20 mm of filament, then 1.68 mm."""
    return 1.75 if position < 20.0 else 1.68


def run(tmp_path, monkeypatch, body, config):
    FilamentBench(tmp_path, monkeypatch, config).run_ready(body)


def read_flow(it):
    return it.get("gcode_move")["extrude_factor"]


@pytest.mark.parametrize("config", [TSL, HALL % ""])
def test_flow_follows_the_width_at_the_nozzle(tmp_path, monkeypatch, config):
    def body(it):
        it.spool.diameter = taper
        it.start_job()
        flows = []
        while it.state != "complete":
            it.pause(0.5)
            flows.append((it.spool.pushed, read_flow(it)))
        thin = (1.75 / 1.68) ** 2
        # thin filament is at the nozzle after 40 mm; up to 10 mm between two
        # measurements, and 2 s of plan
        assert {flow for pushed, flow in flows if 3.0 < pushed < 39.0} == {1.0}
        late = [flow for pushed, flow in flows if pushed > 40.0 + 10.0 + 4.0]
        assert late and all(flow == pytest.approx(thin, abs=0.005) for flow in late)
        it.send("DISABLE_FILAMENT_WIDTH_SENSOR")
        it.pause(1.0)
        assert read_flow(it) == 1.0
    run(tmp_path, monkeypatch, body, config)


def test_hall_status_and_queries(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.spool.diameter = 1.7
        it.pause(2.0)
        status = it.get("hall_filament_width_sensor")
        assert status["Diameter"] == pytest.approx(1.7, abs=0.002)
        assert status["Raw"] == pytest.approx(9480, abs=3)
        assert status["is_active"] and status["flow_compensation_enabled"]
        assert status["filament_detected"] and status["enabled"]
        it.send("QUERY_FILAMENT_WIDTH")
        assert it.output[-1] == "// Filament dia (measured mm): 1.70"
        it.send("QUERY_RAW_FILAMENT_WIDTH")
        assert it.output[-1].startswith("// ADC1=474")
        it.send("ENABLE_FILAMENT_WIDTH_LOG")
        it.pause(2.0)
        it.send("DISABLE_FILAMENT_WIDTH_LOG\nRESET_FILAMENT_WIDTH_SENSOR")
        it.send("DISABLE_FILAMENT_WIDTH_SENSOR")
        assert not it.get("hall_filament_width_sensor")["is_active"]
        it.send("ENABLE_FILAMENT_WIDTH_SENSOR FLOW_COMPENSATION=0")
        assert it.get("hall_filament_width_sensor")["is_active"]
        assert not it.get("hall_filament_width_sensor")["flow_compensation_enabled"]
    run(tmp_path, monkeypatch, body, HALL % "")


def test_hall_sensor_sees_a_runout(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.spool.load(20.0)
        it.start_job()
        assert it.wait_state("complete", "paused") == "paused"
        it.pause(2.0)
        assert it.count("ran out") == 1
        assert it.spool.pushed < 20.0 + 3.5 * 1.6 + 0.8
    run(tmp_path, monkeypatch, body, HALL % "")


def test_current_width_while_the_first_is_on_its_way(tmp_path, monkeypatch):
    def body(it):
        it.spool.diameter = 1.70
        it.pause(4.0)
        assert read_flow(it) == pytest.approx((1.75 / 1.70) ** 2, abs=0.005)
        it.spool.diameter = 1.50        # nobody prints with that: not believed
        it.send("RESET_FILAMENT_WIDTH_SENSOR")
        it.pause(4.0)
        assert read_flow(it) == 1.0
    run(tmp_path, monkeypatch, body, HALL % "use_current_dia_while_delay: True")


def test_off_unless_enabled(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        assert not it.get("hall_filament_width_sensor")["is_active"]
        it.send("DISABLE_FILAMENT_WIDTH_SENSOR")
        assert "off already" in it.output[-1]
    run(tmp_path, monkeypatch, body, (HALL % "").replace("enable: True", ""))


def test_same_calibration_points(tmp_path, monkeypatch):
    def body(it):
        assert "must differ" in it.printer.state_message
    FilamentBench(tmp_path, monkeypatch, (HALL % "").replace("10200", "9000")).run(body)


def test_track():
    track = WidthTrack(20.0, 5.0)
    assert track.get_next() is None
    for position in range(0, 60, 2):
        track.note_width(position, 1.7 + 0.001 * position)
        if position < 20:
            assert track.width is None
        else:
            measured_at = (track.width - 1.7) * 1000
            assert position - 26.0 <= measured_at <= position - 20.0 + 1e-6
    track.clear()
    assert track.width is None and track.get_next() is None
