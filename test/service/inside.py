# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside a booted machine: installs the service, uses it, notes what happens.

usage: inside.py RESULT.json        (as root; the tree is this file's folder)

Nothing is judged here: test_systemd.py does that.
"""

import json
import os
import pathlib
import pwd
import shutil
import socket
import subprocess
import sys
import time
import traceback

TREE = pathlib.Path(__file__).resolve().parent
USER = "printer"
UNITS = pathlib.Path("/etc/systemd/system")
SHOWN = ("ActiveState", "SubState", "Result", "MainPID", "NRestarts", "StatusText",
         "ExecMainStatus", "User")


def call(*command):
    """Output of a command, errors too, and its exit status."""
    result = subprocess.run(command, text=True, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, cwd="/",
                            env={**os.environ, "PYTHONPATH": str(TREE)})
    return result.stdout, result.returncode


def show(unit):
    """Properties of a unit."""
    text, _ = call("systemctl", "show", unit, "-p", ",".join(SHOWN))
    return dict(line.partition("=")[::2] for line in text.splitlines())


def wait_for(what, is_there, seconds):
    """Wait until something is so; returns how long it took (s)."""
    start = time.monotonic()
    while not is_there():
        if time.monotonic() > start + seconds:
            raise TimeoutError("%s is not there after %d s" % (what, seconds))
        time.sleep(.1)
    return time.monotonic() - start


def read_state(path):
    """What the daemon at an API socket says of itself, "" without one."""
    try:
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(5.)
            client.connect(str(path))
            client.sendall(b'{"id": 1, "method": "info"}\x03')
            data = b""
            while not data.endswith(b"\x03"):
                part = client.recv(65536)
                if not part:
                    return ""
                data += part
        return json.loads(data[:-1])["result"]["state"]
    except OSError:
        return ""


class Machine:
    """The steps, in their order; each notes into `results`."""

    def __init__(self):
        self.results = {}
        self.home = None

    def run(self, path):
        """Do all steps and write the results."""
        try:
            for step in (self.install, self.start, self.kill, self.hang, self.stop,
                         self.template, self.tell):
                step()
        except Exception:
            self.results["error"] = traceback.format_exc()
            self.results["journal"] = call("journalctl", "--no-pager", "-n", "80")[0]
        pathlib.Path(path).write_text(json.dumps(self.results, indent=1))

    def install(self):
        call("useradd", "--create-home", USER)
        self.home = pathlib.Path(pwd.getpwnam(USER).pw_dir)
        self.results["install"] = self._install("--no-start")

    def _install(self, *options):
        return call(sys.executable, "-m", "klippy", "install-service", "--user", USER,
                    *options)

    def _prepare(self, unit, data):
        """A config, and what makes the machine of a unit a simulated one."""
        config = data / "config" / "printer.cfg"
        shutil.copy(TREE / "config" / "sample-corexy.cfg", config)
        with config.open("a") as file:
            file.write("\n[gcode_macro HELLO]\ngcode: M117 {printer.toolhead}\n")
        shutil.chown(config, USER)
        lines = (UNITS / unit).read_text().replace("\\\n", " ").splitlines()
        start = next(line for line in lines if line.startswith("ExecStart="))
        folder = UNITS / (unit + ".d")
        folder.mkdir(exist_ok=True)
        (folder / "simulated.conf").write_text(
            "[Service]\nEnvironment=PYTHONPATH=%s\nExecStart=\n%s --simulate\n" % (
                TREE, start))
        call("systemctl", "daemon-reload")

    def _is_ready(self, data):
        return read_state(data / "comms" / "klippy.sock") == "ready"

    def start(self):
        self.data = self.home / "printer_data"
        self._prepare("klipper.service", self.data)
        self.results["start"] = call("systemctl", "start", "klipper")
        self.results["started"] = show("klipper")
        wait_for("ready", lambda: self._is_ready(self.data), 60)
        wait_for("status", lambda: "ready" in show("klipper")["StatusText"], 5)
        self.results["ready"] = show("klipper")
        self.results["cache"] = [path.name for path in
                                 pathlib.Path("/var/cache/klippy").glob("*")]

    def _await_restart(self, pid):
        def is_restarted():
            state = show("klipper")
            return (state["ActiveState"] == "active" and state["MainPID"] != pid
                    and self._is_ready(self.data))
        return wait_for("a new process", is_restarted, 120)

    def kill(self):
        pid = show("klipper")["MainPID"]
        os.kill(int(pid), 9)
        self.results["kill_s"] = self._await_restart(pid)
        self.results["killed"] = show("klipper")

    def hang(self):
        pid = show("klipper")["MainPID"]
        os.kill(int(pid), 19)
        self.results["hang_s"] = self._await_restart(pid)
        self.results["hung"] = show("klipper")

    def stop(self):
        start = time.monotonic()
        self.results["stop"] = call("systemctl", "stop", "klipper")
        self.results["stop_s"] = time.monotonic() - start
        self.results["stopped"] = show("klipper")
        self.results["left"] = sorted(
            path.name for path in (self.data / "comms").iterdir())

    def template(self):
        names = ("left", "right")
        self.results["template"] = self._install(
            "--template", "--printer", names[0], "--printer", names[1], "--no-start")
        folders = [self.home / ("printer_data_" + name) for name in names]
        for folder in folders:
            self._prepare("klipper@.service", folder)
        units = ["klipper@" + name for name in names]
        call("systemctl", "start", *units)
        for folder in folders:
            wait_for("ready", lambda folder=folder: self._is_ready(folder), 60)
        self.results["printers"] = [show(unit) for unit in units]
        self.results["stop_printers"] = call("systemctl", "stop", *units)
        self.results["stopped_printers"] = [show(unit) for unit in units]

    def tell(self):
        self.results["journal"] = call("journalctl", "--no-pager", "-u", "klipper")[0]
        self.results["security"] = call(
            "systemd-analyze", "security", "--no-pager", "klipper.service")[0]
        self.results["udev"] = call("udevadm", "test", "/sys/class/tty/tty0")[0]


if __name__ == "__main__":
    Machine().run(sys.argv[1])
    call("systemctl", "poweroff", "--no-block")
