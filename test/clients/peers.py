# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs that tests start, and how to talk to them: HTTP, websocket."""

import base64
import http.client
import itertools
import json
import os
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
# s, real: these programs know no other time.  Only a failure waits that long, so
# that it may be much longer than any machine needs
PATIENCE = 180.
POLL_PERIOD = 0.05
TEXT_FRAME, CLOSE_FRAME, PING_FRAME = 1, 8, 9


class PeerError(Exception):
    """A client answered with an error."""


def find_port():
    """A TCP port that is free now."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def wait_for(what, condition, patience=PATIENCE):
    """The first true value of condition(); an error if none comes."""
    deadline = time.monotonic() + patience
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < deadline, "no %s within %d s" % (what, patience)
        time.sleep(POLL_PERIOD)


class Process:
    """A program that runs until the test ends it."""

    def __init__(self, name, command, folder):
        self.name, self.log = name, pathlib.Path(folder) / (name + ".out")
        with self.log.open("wb") as stream:
            self.popen = subprocess.Popen(
                [str(part) for part in command], stdin=subprocess.DEVNULL,
                stdout=stream, stderr=subprocess.STDOUT, cwd=folder,
                env={**os.environ, "PYTHONPATH": str(ROOT)} if name == "klippy"
                else None)

    def check(self):
        """Fail if it ended by itself."""
        assert self.popen.poll() is None, "%s ended:\n%s" % (
            self.name, self.log.read_text(errors="replace")[-3000:])
        return True

    def stop(self):
        """End it as a service manager does; returns its exit status."""
        if self.popen.poll() is None:
            self.popen.send_signal(signal.SIGTERM)
        try:
            return self.popen.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.popen.kill()
            return self.popen.wait()


class Daemon(Process):
    """Our own daemon on a simulated machine in real time."""

    def __init__(self, folder, config_path, speed=1.):
        self.socket_path, self.tty_path = folder / "klippy.sock", folder / "tty"
        self.log_path = folder / "logs" / "klippy.log"
        super().__init__("klippy", [
            sys.executable, "-m", "klippy", "run", config_path, "--simulate",
            "--speed", speed, "-a", self.socket_path, "-I", self.tty_path,
            "-l", self.log_path], folder)
        wait_for("API socket", lambda: self.check() and self.socket_path.exists())

    def read_state(self):
        """What the API's info tells of the printer now: ready, startup, ...

        "gone" if the printer ends meanwhile, as before a restart.
        """
        data = b""
        with socket.socket(socket.AF_UNIX) as sock:
            sock.settimeout(PATIENCE)
            try:
                sock.connect(str(self.socket_path))
                sock.sendall(b'{"id": 1, "method": "info"}\x03')
                while not data.endswith(b"\x03"):
                    more = sock.recv(65536)
                    if not more:
                        return "gone"
                    data += more
            except (ConnectionError, FileNotFoundError):
                return "gone"
        return json.loads(data[:-1])["result"]["state"]


class Web:
    """JSON over HTTP."""

    def __init__(self, port, headers=()):
        self.port, self.headers = port, dict(headers)

    def ask(self, verb, path, **params):
        """(status, decoded answer) of one request; raises OSError unconnected."""
        return self._send(verb, path, json.dumps(params) if params else None,
                          "application/json")

    def upload(self, path, name, data):
        """Post a file as a form does.  Raises PeerError."""
        mark = "mark-%s" % (os.urandom(8).hex(),)
        head = ('--%s\r\nContent-Disposition: form-data; name="file"; filename="%s"'
                "\r\nContent-Type: application/octet-stream\r\n\r\n" % (mark, name))
        body = head.encode() + data + ("\r\n--%s--\r\n" % (mark,)).encode()
        return self._check(path, *self._send(
            "POST", path, body, "multipart/form-data; boundary=" + mark))

    def _send(self, verb, path, body, kind):
        connection = http.client.HTTPConnection("127.0.0.1", self.port,
                                                timeout=PATIENCE)
        try:
            connection.request(verb, path, body,
                               {"Content-Type": kind, **self.headers})
            answer = connection.getresponse()
            data = answer.read()
        finally:
            connection.close()
        return answer.status, json.loads(data) if data else None

    def get(self, path):
        """The answer of a GET.  Raises PeerError."""
        return self._check(path, *self.ask("GET", path))

    def post(self, path, **params):
        """The answer of a POST.  Raises PeerError."""
        return self._check(path, *self.ask("POST", path, **params))

    @staticmethod
    def _check(path, status, answer):
        if status >= 400:
            raise PeerError("%s: %d %s" % (path, status, answer))
        return answer["result"] if answer and "result" in answer else answer

    def is_up(self, path):
        """True once a GET is answered."""
        try:
            return self.ask("GET", path)[0] == 200
        except (OSError, http.client.HTTPException):
            return False


class WebSocket:
    """JSON-RPC over a websocket (RFC 6455)."""

    def __init__(self, port, path="/websocket"):
        self.sock = socket.create_connection(("127.0.0.1", port), PATIENCE)
        key = base64.b64encode(os.urandom(16)).decode()
        self.sock.sendall((
            "GET %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Key: %s\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n" % (path, port, key)).encode())
        self.data = b""
        while b"\r\n\r\n" not in self.data:
            self._receive()
        head, _, self.data = self.data.partition(b"\r\n\r\n")
        assert b" 101 " in head.splitlines()[0], head
        self.numbers = itertools.count(1)
        self.notices = []           # (method, params)

    def close(self):
        self.sock.close()

    def ask(self, method, **params):
        """The result of a request.  Raises PeerError."""
        number = next(self.numbers)
        self._send_frame(TEXT_FRAME, json.dumps({
            "jsonrpc": "2.0", "method": method, "params": params,
            "id": number}).encode())
        while True:
            message = self._read_message()
            if message.get("id") == number:
                break
        if "error" in message:
            raise PeerError("%s: %s" % (method, message["error"]["message"]))
        return message["result"]

    def wait_notice(self, condition):
        """Notices (method, params) up to the one that condition(method, params)
        holds for; they are taken.  Others that come do not make it wait longer."""
        checked, deadline = 0, time.monotonic() + PATIENCE
        while True:
            assert time.monotonic() < deadline, "the notice did not come"
            for number in range(checked, len(self.notices)):
                if condition(*self.notices[number]):
                    taken = self.notices[:number + 1]
                    del self.notices[:number + 1]
                    return taken
            checked = len(self.notices)
            self._read_message()

    def _read_message(self):
        """The next message; notices are noted too."""
        while True:
            kind, payload = self._read_frame()
            if kind == PING_FRAME:
                self._send_frame(PING_FRAME + 1, payload)
            assert kind != CLOSE_FRAME, "the websocket was closed: %r" % (payload,)
            if kind == TEXT_FRAME:
                break
        message = json.loads(payload)
        if "id" not in message:
            self.notices.append((message["method"], message.get("params", [])))
        return message

    def _receive(self):
        data = self.sock.recv(1 << 16)
        assert data, "the websocket's connection ended"
        self.data += data

    def _take(self, count):
        while len(self.data) < count:
            self._receive()
        taken, self.data = self.data[:count], self.data[count:]
        return taken

    def _read_frame(self):
        first, size = self._take(2)
        if size == 126:
            size, = struct.unpack(">H", self._take(2))
        elif size == 127:
            size, = struct.unpack(">Q", self._take(8))
        return first & 15, self._take(size)

    def _send_frame(self, kind, payload):
        if len(payload) < 126:
            size = bytes([128 | len(payload)])
        else:
            size = bytes([128 | 126]) + struct.pack(">H", len(payload))
        # a mask of zeros leaves the payload as it is
        self.sock.sendall(bytes([128 | kind]) + size + bytes(4) + payload)
