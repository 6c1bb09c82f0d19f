# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy demo --web`: the page, its data, its commands, and who may use it."""

import http.client
import json
import re
import shutil
import subprocess
import sys
import time

import pytest
from machine_configs import BED, make_axes

JOB = "M140 S40\nG28\nG1 X10 Y10 Z0.2 F6000\nG1 X60 E2 F1200\nG1 Y60 E4\nG1 X10 E6\n"
PATIENCE = 180.                 # real s; only a failing test waits that long
BROWSER = next(filter(None, map(shutil.which, (
    "chromium", "chromium-browser", "google-chrome"))), None)


class Page:
    """A demo in a process of its own, and a client of its page."""

    def __init__(self, folder):
        (folder / "job.gcode").write_text(JOB)
        (folder / "printer.cfg").write_text(make_axes("cartesian", extra=BED))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "klippy", "demo", str(folder / "job.gcode"),
             "--config", str(folder / "printer.cfg"), "--web", "0", "--speed", "50"],
            stdout=subprocess.PIPE, text=True)
        for line in self.process.stdout:
            found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
            if found:
                self.port = int(found.group(1))
                return
        raise AssertionError("the demo ended")

    def ask(self, method, path, body=None, **headers):
        """(status, content) of a request."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port,
                                                timeout=PATIENCE)
        headers = {name.replace("_", "-"): text for name, text in headers.items()}
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        status, data = answer.status, answer.read()
        connection.close()
        return status, data

    def state(self):
        status, data = self.ask("GET", "/api/state?path=0&console=0&heat=0")
        state = json.loads(data)
        return state if status == 200 else {"state": state["error"]}

    def command(self, name, **params):
        status, data = self.ask("POST", "/api/" + name, json.dumps(params),
                                X_Klippy="1")
        return status, json.loads(data)

    def wait(self, is_true):
        end = time.monotonic() + PATIENCE
        while True:
            state = self.state()
            if is_true(state):
                return state
            assert time.monotonic() < end, state
            time.sleep(.1)          # the page's process has a clock of its own

    def close(self):
        self.process.terminate()
        self.process.wait(PATIENCE)
        self.process.stdout.close()


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    made = Page(tmp_path_factory.mktemp("web"))
    yield made
    made.close()


def has_printed(state):
    return state.get("print_stats", {}).get("state") == "complete"


def list_drawn(state):
    """Ends of the segments with filament."""
    return [tuple(point[:3]) for point in state["path"] if point[3]]


def test_print_is_shown_as_it_is_made(page):
    # the file is read to its end before the machine has come there
    state = page.wait(lambda s: has_printed(s) and list_drawn(s)[-1:] == [
        (10., 60., .2)])
    drawn = list_drawn(state)
    assert {(60., 10., .2), (60., 60., .2)} <= set(drawn)
    assert all(point[3] in (0, 1) for point in state["path"])
    assert state["files"] == ["job.gcode"] and state["speed"] == 50.
    assert state["heaters"]["heater_bed"]["target"] == 40.
    assert len(state["heat"]) > 3 and "heater_bed" in state["heat"][-1]["heaters"]
    assert "File selected" in state["console"]


def test_only_what_is_new_is_sent(page):
    state = page.wait(lambda s: has_printed(s) and list_drawn(s)[-1:] == [
        (10., 60., .2)])
    query = "/api/state?path=%d&console=%d&heat=%d" % (
        state["path_next"], state["console_next"], 10 ** 9)
    new = json.loads(page.ask("GET", query)[1])
    assert new["path"] == [] and new["console"] == [] and new["heat"]


def test_commands_answer_in_the_console(page):
    page.wait(has_printed)
    assert page.command("script", script="ECHO from the page") == (200, {})
    assert page.command("script", script="G1 X1000") == (200, {})
    state = page.wait(lambda s: any("Move out of range" in t for t in s["console"]))
    assert "> ECHO from the page" in state["console"]
    assert "// ECHO from the page" in state["console"]
    assert page.command("speed", speed=20) == (200, {})
    assert page.wait(lambda s: s["speed"] == 20.)


@pytest.mark.parametrize("name, body, status, said", [
    ("speed", '{"speed": 0}', 503, "above 0"),
    ("speed", '{"speed": "x"}', 503, "above 0"),
    ("script", "{}", 503, "must be a text"), ("script", "{", 400, "malformed"),
    ("script", "[]", 400, "malformed"), ("script", "\xff", 400, "malformed"),
    ("nothing", "{}", 404, "nothing here"),
    ("script", "x" * 70000, 413, "at most")])
def test_bad_requests_are_refused(page, name, body, status, said):
    got, data = page.ask("POST", "/api/" + name, body.encode("latin-1"), X_Klippy="1")
    assert got == status and said in json.loads(data)["error"]
    assert page.state()["state"] == "ready"


def test_other_sites_can_neither_read_nor_command(page):
    for path in ("/", "/api/state?path=0"):
        assert page.ask("GET", path, Host="evil.example")[0] == 403
    body = json.dumps({"script": "ECHO evil"})
    assert page.ask("POST", "/api/script", body)[0] == 403
    assert page.ask("POST", "/api/script", body, X_Klippy="1", Host="a.b:80")[0] == 403
    assert not any("evil" in text for text in page.state()["console"])
    assert page.ask("GET", "/../setup.py")[0] == 404
    assert page.ask("GET", "/api/state?path=x")[0] == 400


@pytest.mark.skipif(BROWSER is None, reason="no browser here")
def test_browser_shows_the_printer(page, tmp_path):
    page.wait(has_printed)
    picture = tmp_path / "page.png"
    run = subprocess.run(
        [BROWSER, "--headless", "--no-sandbox", "--disable-gpu",
         "--disable-dev-shm-usage", "--user-data-dir=%s" % (tmp_path / "profile",),
         "--timeout=6000", "--window-size=1200,900", "--screenshot=%s" % (picture,),
         "--enable-logging=stderr", "http://127.0.0.1:%d/" % (page.port,)],
        capture_output=True, text=True, timeout=120)
    assert picture.stat().st_size > 20000, run.stderr
    assert "Uncaught" not in run.stderr, run.stderr


def test_emergency_stop_and_restart(page):
    page.wait(has_printed)
    assert page.command("stop") == (200, {})
    state = page.wait(lambda s: s["state"] == "shutdown")
    assert "emergency stop" in state["message"]
    assert page.command("script", script="FIRMWARE_RESTART")[0] == 200
    page.wait(lambda s: s["state"] == "ready")
    page.command("script", script="G28")
    page.wait(lambda s: s["toolhead"]["homed_axes"] == "xyz")
