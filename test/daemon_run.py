# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon itself on a simulated machine, spoken to by its API socket.

Everything is real but the time and the machine: the config file, the socket, the
loop that starts printer after printer, the firmware.
"""

import argparse
import json
import os
import pathlib
import signal
import socket

import greenlet

from klippy.cli import run
from klippy.simulator import session
from klippy.simulator.machine import SimMachine
from klippy_ext.vworld import VirtualWorld

END = b"\x03"
ANSWER_TIMEOUT = 3600.      # s, virtual
POLL_PERIOD = 0.05


class ApiError(Exception):
    """The host answered a request with an error."""


class Client:
    """A client of the API socket; its waiting is the host's own time."""

    def __init__(self, path, reactor):
        self.reactor = reactor
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.connect(str(path))
        self.sock.setblocking(False)
        self.data, self.answers, self.number = b"", {}, 0
        self.output = []            # texts of the G-code terminal
        self.ask("gcode/subscribe_output", response_template={"output": True})

    def close(self):
        self.sock.close()

    def send(self, method, **params):
        """Send a request; returns its number."""
        self.number += 1
        data = json.dumps({"id": self.number, "method": method,
                           "params": params}).encode() + END
        while data:
            try:
                data = data[self.sock.send(data):]
            except BlockingIOError:
                self.reactor.pause(self.reactor.monotonic() + POLL_PERIOD)
        return self.number

    def ask(self, method, **params):
        """The result of a request.  Raises ApiError."""
        number = self.send(method, **params)
        deadline = self.reactor.monotonic() + ANSWER_TIMEOUT
        while number not in self.answers:
            assert self.reactor.monotonic() < deadline, "no answer to " + method
            self.reactor.pause(self.reactor.monotonic() + POLL_PERIOD)
            self._receive()
        answer = self.answers.pop(number)
        if "error" in answer:
            raise ApiError(answer["error"]["message"])
        return answer["result"]

    def _receive(self):
        try:
            self.data += self.sock.recv(1 << 20)
        except BlockingIOError:
            return
        *messages, self.data = self.data.split(END)
        for message in map(json.loads, messages):
            if message.get("output"):
                self.output.append(message["params"]["response"])
            else:
                self.answers[message["id"]] = message


class Host(run.Daemon):
    """A daemon that a test drives, boot after boot, on one machine."""

    def __init__(self, folder, machine_config, options=()):
        """machine_config: text of the printer.cfg that the machine is made by.

        options: more arguments of the command line.
        """
        self.folder = pathlib.Path(folder)
        self.config_path = self.folder / "printer.cfg"
        self.socket_path = self.folder / "api"
        parser = argparse.ArgumentParser()
        run.add_arguments(parser)
        super().__init__(parser.parse_args([
            str(self.config_path), "-a", str(self.socket_path),
            "-I", str(self.folder / "tty"), *options]))
        self.config_path.write_text(machine_config)
        self.world = VirtualWorld(seed=1)
        self.machine = SimMachine(
            self.world, session.load_sections(str(self.config_path)), 1)
        self.bodies, self.failure, self.client, self.boots = [], None, None, 0

    def run_boots(self, *bodies, restart="gcode/restart"):
        """Call one body(host) a boot, once the printer started or cannot.

        restart: the request that comes between two of them.
        """
        self.bodies, self.restart = list(bodies), restart
        status = self.run()
        self.client.close()
        if self.failure is not None:
            raise self.failure
        assert not self.bodies and status == 0

    def _make_start_args(self):
        super()._make_start_args()
        if self.machine is not None:
            self.start_args["machine"] = self.machine

    def _make_clock(self):
        return self.world

    def _run_printer(self, reactor):
        self.reactor = reactor
        self.boots += 1
        reactor.register_callback(self._follow)
        return super()._run_printer(reactor)

    def _follow(self, eventtime):
        if self.client is not None:
            self.client.close()
        self.client = Client(self.socket_path, self.reactor)
        try:
            while self.info()["state"] == "startup":
                self.pause(0.1)
            self.bodies.pop(0)(self)
        except greenlet.GreenletExit:
            return          # the printer ended meanwhile, as by SAVE_CONFIG
        except BaseException as err:
            self.failure, self.bodies = err, []
        if self.bodies:
            self.client.send(self.restart)
        else:
            os.kill(os.getpid(), signal.SIGTERM)

    # What bodies use

    def pause(self, seconds):
        """Let virtual time pass."""
        self.reactor.pause(self.reactor.monotonic() + seconds)

    def info(self):
        """Answer of the endpoint info."""
        return self.client.ask("info")

    def script(self, text):
        """Run G-code.  Raises ApiError."""
        self.client.ask("gcode/script", script=text)

    def status(self, name):
        """Status of one printer object."""
        return self.client.ask("objects/query", objects={name: None})["status"][name]

    @property
    def output(self):
        """What the terminal was told since the boot."""
        return self.client.output
