# SPDX-License-Identifier: GPL-3.0-or-later
"""Moonraker, the real one, drives our daemon: each test goes on from the last."""

import pathlib

import packages
import peers
import pytest

pytestmark = pytest.mark.skipif(
    packages.find_python("moonraker") is None,
    reason="moonraker is not installed: make setup-clients")

JOB = (pathlib.Path(__file__).resolve().parents[1]
       / "klippy" / "slicers" / "prusaslicer.gcode")
CONFIG = """[server]
host: 127.0.0.1
port: %d
klippy_uds_address: %s

[machine]
provider: none
validate_service: False

[authorization]
trusted_clients: 127.0.0.1

[file_manager]
enable_object_processing: True

[history]
"""
# What Moonraker uses of a printer; it warns of what is missing
OBJECTS = {"webhooks", "configfile", "mcu", "gcode_move", "toolhead", "extruder",
           "heater_bed", "heaters", "fan", "print_stats", "virtual_sdcard",
           "display_status", "pause_resume", "exclude_object", "idle_timeout",
           "motion_report", "query_endstops", "system_stats"}


class Moonraker(peers.Process):
    """The server and two ways to talk to it."""

    def __init__(self, folder, socket_path):
        port = peers.find_port()
        (folder / "config" / "moonraker.conf").write_text(CONFIG % (port, socket_path))
        super().__init__("moonraker", [
            packages.find_python("moonraker"), "-m", "moonraker", "-d", folder], folder)
        self.web = peers.Web(port)
        peers.wait_for("Moonraker", lambda: self.check()
                       and self.web.is_up("/server/info"))
        self.socket = peers.WebSocket(port)

    def wait_state(self, state):
        """Wait until the printer is seen in a state."""
        peers.wait_for("state " + state, lambda: self.web.get("/server/info")[
            "klippy_state"] == state)

    def query(self, name):
        """Status of one printer object."""
        return self.web.get("/printer/objects/query?" + name)["status"][name]

    def run_script(self, text):
        return self.web.post("/printer/gcode/script", script=text)

    def wait_job(self, state):
        peers.wait_for("job that is " + state, lambda: self.query("print_stats")[
            "state"] == state)


@pytest.fixture(scope="module")
def moonraker(data_folder, daemon):
    server = Moonraker(data_folder, daemon.socket_path)
    server.wait_state("ready")
    yield server
    server.socket.close()
    server.stop()


def test_connects_without_warnings(moonraker, data_folder):
    info = moonraker.web.get("/server/info")
    assert info["klippy_connected"] and info["warnings"] == []
    assert info["failed_components"] == info["missing_klippy_requirements"] == []
    assert set(info["registered_directories"]) == {
        "config", "logs", "gcodes", "config_examples", "docs"}
    printer = moonraker.web.get("/printer/info")
    assert printer["state_message"] == "Printer is ready"
    assert printer["config_file"] == str(data_folder / "config" / "printer.cfg")
    log = (data_folder / "logs" / "moonraker.log").read_text()
    assert "Traceback" not in log


def test_objects_and_help(moonraker):
    assert OBJECTS <= set(moonraker.web.get("/printer/objects/list")["objects"])
    status = moonraker.web.get("/printer/objects/query?toolhead=position,homed_axes"
                               "&configfile=settings")["status"]
    assert set(status["toolhead"]) == {"position", "homed_axes"}
    assert status["configfile"]["settings"]["printer"]["max_velocity"] == 300.
    texts = moonraker.web.get("/printer/gcode/help")
    assert texts["HOLD_QUEUE"] == "Hold the queue of jobs"
    assert moonraker.web.get("/printer/query_endstops/status") == {
        "x": "open", "y": "open", "z": "open"}


def test_subscriptions_and_console(moonraker):
    ws = moonraker.socket
    first = ws.ask("printer.objects.subscribe", objects={
        "display_status": ["message"], "toolhead": None})
    assert first["status"]["display_status"] == {"message": None}
    assert ws.ask("printer.gcode.script", script="M117 hello") == "ok"
    ws.wait_notice(lambda method, params: method == "notify_status_update"
                   and params[0].get("display_status") == {"message": "hello"})
    ws.ask("printer.gcode.script", script="RESPOND MSG=there")
    ws.wait_notice(lambda method, params: method == "notify_gcode_response"
                   and params == ["echo: there"])
    with pytest.raises(peers.PeerError, match="Must home axis first"):
        ws.ask("printer.gcode.script", script="G1 X5")
    ws.wait_notice(lambda method, params: method == "notify_gcode_response"
                   and params[0].startswith("!! Must home axis first"))
    texts = [entry["message"] for entry in ws.ask("server.gcode_store")["gcode_store"]]
    assert {"M117 hello", "RESPOND MSG=there", "echo: there"} <= set(texts)
    for sensor in ("extruder", "heater_bed"):
        peers.wait_for("temperature", lambda: ws.ask("server.temperature_store")[
            sensor]["temperatures"][-1] > 10.)      # noqa: B023


def test_prints_pauses_resumes_and_leaves_an_object_out(moonraker, data_folder):
    moonraker.web.upload("/server/files/upload", "part.gcode", JOB.read_bytes())
    assert (data_folder / "gcodes" / "part.gcode").read_bytes() == JOB.read_bytes()
    peers.wait_for("metadata", lambda: moonraker.web.ask(
        "GET", "/server/files/metadata?filename=part.gcode")[0] == 200)
    meta = moonraker.web.get("/server/files/metadata?filename=part.gcode")
    assert meta["slicer"] == "PrusaSlicer" and meta["estimated_time"] == 21
    moonraker.web.post("/printer/print/start", filename="part.gcode")
    moonraker.wait_job("printing")
    peers.wait_for("first part", lambda: moonraker.query("exclude_object")[
        "current_object"] == "PART_A")
    moonraker.web.post("/printer/print/pause")
    moonraker.wait_job("paused")
    assert moonraker.query("pause_resume")["is_paused"]
    moonraker.run_script("EXCLUDE_OBJECT NAME=PART_B")
    assert moonraker.query("exclude_object")["excluded_objects"] == ["PART_B"]
    moonraker.socket.ask("printer.objects.subscribe", objects={
        "toolhead": ["position"], "print_stats": ["state"]})
    moonraker.web.post("/printer/print/resume")
    notices = moonraker.socket.wait_notice(lambda method, params: (
        method == "notify_status_update"
        and params[0].get("print_stats", {}).get("state") == "complete"))
    assert moonraker.query("toolhead")["position"][:2] == [10., 180.]
    places = [params[0]["toolhead"]["position"] for method, params in notices
              if method == "notify_status_update"
              and "position" in params[0].get("toolhead", {})]
    # the upper layers of the first part were printed; of the other only the way
    # to its corner (104, 84) is left
    upper = [x for x, y, z, e in places if z > 0.5 and y < 100.]
    assert upper and max(upper) <= 104.


def test_cancels_and_keeps_a_history(moonraker):
    moonraker.web.post("/printer/print/start", filename="part.gcode")
    moonraker.wait_job("printing")
    moonraker.web.post("/printer/print/cancel")
    moonraker.wait_job("cancelled")
    jobs = peers.wait_for("two jobs", lambda: [
        jobs for jobs in [moonraker.web.get("/server/history/list?order=asc")["jobs"]]
        if len(jobs) == 2 and jobs[1]["status"] != "in_progress"])[0]
    assert [job["status"] for job in jobs] == ["completed", "cancelled"]
    assert jobs[0]["filename"] == "part.gcode" and jobs[0]["exists"]
    assert jobs[0]["metadata"]["slicer"] == "PrusaSlicer"
    assert jobs[0]["filament_used"] > 9. and jobs[0]["print_duration"] > 3.


def test_remote_methods(moonraker):
    moonraker.run_script("HOLD_QUEUE")
    assert moonraker.web.get("/server/job_queue/status")["queue_state"] == "paused"
    ws = moonraker.socket
    ws.ask("server.connection.identify", client_name="beeper", version="1",
           type="agent", url="http://localhost")
    ws.ask("connection.register_remote_method", method_name="agent_beep")
    moonraker.run_script("CALL_AGENT TONE=440")
    ws.wait_notice(lambda method, params: method == "agent_beep"
                   and params == {"tone": 440})


def test_restart(moonraker):
    moonraker.run_script("M117 before")
    assert moonraker.web.post("/printer/restart") == "ok"
    moonraker.socket.wait_notice(lambda method, params:
                                 method == "notify_klippy_disconnected")
    moonraker.socket.wait_notice(lambda method, params:
                                 method == "notify_klippy_ready")
    assert moonraker.query("display_status")["message"] is None
    # methods of agents are told to the new printer too
    moonraker.run_script("CALL_AGENT TONE=50")
    moonraker.socket.wait_notice(lambda method, params: params == {"tone": 50})


def test_config_error_and_recovery(moonraker, data_folder):
    path = data_folder / "config" / "printer.cfg"
    text = path.read_text()
    path.write_text(text.replace("max_accel: 4000", "max_acel: 4000"))
    moonraker.web.post("/printer/restart")
    moonraker.wait_state("error")
    info = moonraker.web.get("/printer/info")
    assert "max_acel" in info["state_message"]
    path.write_text(text)
    moonraker.web.post("/printer/restart")
    moonraker.wait_state("ready")


def test_emergency_stop_and_firmware_restart(moonraker):
    moonraker.web.post("/printer/emergency_stop")
    moonraker.wait_state("shutdown")
    assert "webhooks" in moonraker.web.get("/printer/info")["state_message"]
    with pytest.raises(peers.PeerError, match="webhooks"):
        moonraker.run_script("G28")
    moonraker.web.post("/printer/firmware_restart")
    moonraker.wait_state("ready")
    moonraker.run_script("G28 X")
    assert moonraker.query("toolhead")["homed_axes"] == "x"


def test_leaves_no_complaint_in_its_log(moonraker, data_folder):
    log = (data_folder / "logs" / "moonraker.log").read_text()
    assert "Traceback" not in log
    assert moonraker.web.get("/server/info")["warnings"] == []
