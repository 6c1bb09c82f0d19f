# SPDX-License-Identifier: GPL-3.0-or-later
"""OctoPrint, the real one, prints a whole file through the daemon's terminal."""

import pathlib
import re

import packages
import peers
import pytest

pytestmark = pytest.mark.skipif(
    packages.find_python("octoprint") is None,
    reason="octoprint is not installed: make setup-clients")

JOB = (pathlib.Path(__file__).resolve().parents[1]
       / "klippy" / "slicers" / "cura.gcode")
API_KEY = "0123456789ABCDEF0123456789ABCDEF"
CONFIG = """api:
  key: %s
server:
  firstRun: false
  onlineCheck:
    enabled: false
  pluginBlacklist:
    enabled: false
plugins:
  _disabled: [announcements, pluginmanager, softwareupdate, tracking, discovery,
              errortracking, virtual_printer]
serial:
  log: true
  additionalPorts: ["%s"]
"""


class OctoPrint(peers.Process):
    """The server, and its API."""

    def __init__(self, folder, tty_path):
        self.base = folder / "octoprint"
        (self.base / "uploads").mkdir(parents=True)
        (self.base / "config.yaml").write_text(CONFIG % (API_KEY, tty_path))
        (self.base / "uploads" / "part.gcode").write_bytes(JOB.read_bytes())
        port = peers.find_port()
        super().__init__("octoprint", [
            packages.find_python("octoprint"), "-m", "octoprint", "serve",
            "--iknowwhatimdoing", "--host", "127.0.0.1", "--port", port,
            "--basedir", self.base], folder)
        self.web = peers.Web(port, {"X-Api-Key": API_KEY})
        peers.wait_for("OctoPrint", lambda: self.check()
                       and self.web.is_up("/api/version"))

    def wait_state(self, text, patience=peers.PATIENCE):
        """Wait until the printer is seen in a state."""
        peers.wait_for("state " + text, lambda: self.web.get("/api/connection")[
            "current"]["state"] == text, patience)

    @property
    def talk(self):
        """All that went over the terminal."""
        return (self.base / "logs" / "serial.log").read_text()


@pytest.fixture(scope="module")
def octoprint(data_folder, daemon):
    server = OctoPrint(data_folder, daemon.tty_path)
    server.web.post("/api/connection", command="connect", baudrate=115200,
                    port=str(daemon.tty_path))
    server.wait_state("Operational")
    yield server
    server.stop()


def test_connects_and_reads_temperatures(octoprint):
    peers.wait_for("temperature", lambda: octoprint.web.get("/api/printer")[
        "temperature"].get("tool0", {}).get("actual", 0.) > 10.)
    assert octoprint.web.get("/api/printer")["temperature"]["bed"]["actual"] > 10.
    assert "FIRMWARE_NAME:Klipper" in octoprint.talk


def test_prints_a_whole_file(octoprint):
    octoprint.web.post("/api/files/local/part.gcode", command="select", print=True)
    octoprint.wait_state("Printing")
    octoprint.wait_state("Operational")
    peers.wait_for("progress of 100 %", lambda: octoprint.web.get("/api/job")[
        "progress"]["completion"] == 100.)
    octoprint.web.post("/api/printer/command", commands=["M114"])
    position = peers.wait_for("position", lambda: re.search(
        r"Recv: .*X:(\S+) Y:(\S+) Z:(\S+) E:", octoprint.talk))
    assert [float(text) for text in position.groups()] == [10., 180., 10.6]
    for word in ("Resend", "rs ", "!!", "Error", "Unknown command"):
        assert "Recv: %s" % (word,) not in octoprint.talk
    log = (octoprint.base / "logs" / "octoprint.log").read_text()
    assert not re.findall(r".*octoprint\.util\.comm - (?:WARNING|ERROR).*", log)


def test_every_line_was_run_once(octoprint):
    sent = re.findall(r"Send: N\d+ (G[01] [^*]*)\*", octoprint.talk)
    moves = [line.partition(";")[0].strip() for line in JOB.read_text().splitlines()
             if line.startswith(("G0 ", "G1 "))]
    assert [line.strip() for line in sent] == moves


def test_emergency_stop_and_recovery(octoprint, daemon):
    octoprint.web.post("/api/printer/command", commands=["M112"])
    peers.wait_for("shutdown", lambda: "the printer shuts down" in
                   daemon.log_path.read_text())
    peers.wait_for("hanging up", lambda: "closing down monitor" in octoprint.talk)
    octoprint.web.post("/api/connection", command="connect", baudrate=115200,
                       port=str(daemon.tty_path))
    octoprint.wait_state("Operational")
    octoprint.web.post("/api/printer/command", commands=["FIRMWARE_RESTART"])
    peers.wait_for("restart", lambda: daemon.log_path.read_text().count(
        "configured, ") == 2 and daemon.read_state() == "ready")
    octoprint.web.post("/api/printer/command",
                       commands=["G28 X", "G1 X12 F6000", "M114"])
    try:
        peers.wait_for("position", lambda: "Recv: X:12.000" in octoprint.talk)
    except AssertionError as error:
        raise AssertionError("%s; the talk ends:\n%s" % (
            error, octoprint.talk[-2000:])) from None
