# SPDX-License-Identifier: GPL-3.0-or-later
"""Serves the page on the loopback address, and passes requests to the reactor.

Requests are served in threads; everything that touches the printer runs on its
reactor.  A page of another site can neither read nor command: requests must
name this server as their host, and commands must carry a header of ours.
"""

import http.server
import json
import logging
import pathlib
import threading
import urllib.parse

from klippy.errors import PrinterError

PAGE = pathlib.Path(__file__).with_name("page.html")
ADDRESS = "127.0.0.1"
MAX_BODY = 64 * 1024
ANSWER_TIMEOUT = 5.             # s a printer may take to answer
MAX_SPEED = 1000.
NOT_FOR_YOU = {"error": "this page is served to this computer only"}


class Bridge:
    """Calls functions on the reactor of the printer that runs now."""

    def __init__(self):
        self.reactor = None

    def call(self, func):
        """Result of func() on the reactor.  Raises what it raises, and
        PrinterError when nobody answers.  Any thread."""
        done, answer = threading.Event(), {}

        def run(eventtime):
            try:
                answer["result"] = func()
            except Exception as err:
                # handed to the thread that asked
                answer["error"] = err
            done.set()
        reactor = self.reactor
        if reactor is None:
            raise PrinterError("The printer is starting")
        reactor.register_async_callback(run)
        if not done.wait(ANSWER_TIMEOUT):
            raise PrinterError("The printer does not answer: is it restarting?")
        if "error" in answer:
            raise answer["error"]
        return answer["result"]

    def start(self, func):
        """Have func() called on the reactor, without waiting for it."""
        if self.reactor is None:
            raise PrinterError("The printer is starting")
        self.reactor.register_async_callback(lambda eventtime: func())


class WebServer:
    """The page, the state of the printer as JSON, and the way of commands."""

    def __init__(self, feed, port):
        """port: 0 takes any.  Raises OSError if it is taken."""
        self.feed, self.bridge = feed, Bridge()
        self.httpd = http.server.ThreadingHTTPServer((ADDRESS, port), Handler)
        self.httpd.daemon_threads = True
        self.httpd.web = self
        self.port = self.httpd.server_address[1]
        self.url = "http://%s:%d/" % (ADDRESS, self.port)
        self.thread = threading.Thread(target=self.httpd.serve_forever,
                                       name="web", daemon=True)
        self.thread.start()

    def attach(self, printer):
        """Serve this printer from now on."""
        self.feed.attach(printer)
        self.bridge.reactor = printer.get_reactor()

    def detach(self):
        """The printer is gone, another one will come."""
        self.bridge.reactor = None

    def close(self):
        self.detach()
        self.httpd.shutdown()
        self.httpd.server_close()
        self.thread.join()

    # What pages ask for

    def read_state(self, query):
        """State since what the page knows: query has path, console and heat."""
        numbers = [int(query.get(name, ["0"])[0])
                   for name in ("path", "console", "heat")]
        return self.bridge.call(lambda: self.feed.read(*numbers))

    def run_script(self, request):
        """Run G-code; its answers come with the console."""
        script = request.get("script")
        if not isinstance(script, str):
            raise PrinterError("'script' must be a text")

        def run():
            gcode = self.feed.printer.lookup_object("gcode")
            self.feed.console.append("> " + script)
            try:
                gcode.run_script(script)
            except PrinterError:
                # the console has it
                logging.info("web: '%s' failed", script)
        self.bridge.start(run)
        return {}

    def set_speed(self, request):
        """Let so many virtual seconds pass a real one."""
        speed = request.get("speed")
        if not isinstance(speed, (int, float)) or not 0 < speed <= MAX_SPEED:
            raise PrinterError("'speed' must be above 0, at most %d" % (MAX_SPEED,))
        self.bridge.call(lambda: self.feed.reactor.set_pace(float(speed)))
        return {}

    def stop(self, request):
        """Emergency stop."""
        self.bridge.start(lambda: self.feed.printer.invoke_shutdown(
            "Shutdown due to the web page's emergency stop"))
        return {}


def read_request(body):
    """The JSON object of a command.  Raises ValueError."""
    request = json.loads(body)
    if not isinstance(request, dict):
        raise ValueError("it is no JSON object")
    return request


class Handler(http.server.BaseHTTPRequestHandler):
    """One request."""
    protocol_version = "HTTP/1.1"
    timeout = 30
    ACTIONS = {"/api/script": WebServer.run_script, "/api/speed": WebServer.set_speed,
               "/api/stop": WebServer.stop}

    def log_message(self, format, *args):
        logging.debug("web: " + format, *args)

    def _is_for_us(self):
        host = self.headers.get("Host", "")
        return host.rpartition(":")[0] in (ADDRESS, "localhost")

    def _answer(self, status, body, kind="application/json"):
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(data)

    def _run(self, func):
        try:
            self._answer(200, func())
        except PrinterError as err:
            self._answer(503, {"error": str(err)})
        except (ValueError, KeyError, TypeError) as err:
            self._answer(400, {"error": "malformed request: %s" % (err,)})
        except ConnectionError:
            self.close_connection = True

    def do_GET(self):
        """The page or the state."""
        url = urllib.parse.urlsplit(self.path)
        if not self._is_for_us():
            self._answer(403, NOT_FOR_YOU)
        elif url.path == "/":
            self._answer(200, PAGE.read_bytes(), "text/html; charset=utf-8")
        elif url.path == "/api/state":
            query = urllib.parse.parse_qs(url.query)
            self._run(lambda: self.server.web.read_state(query))
        else:
            self._answer(404, {"error": "there is nothing here"})

    def do_POST(self):
        """A command; with the header X-Klippy, which no form can send."""
        action = self.ACTIONS.get(self.path)
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > MAX_BODY:
            self.close_connection = True
            self._answer(413, {"error": "a command has at most %d bytes" % MAX_BODY})
            return
        body = self.rfile.read(int(length))
        if action is None:
            self._answer(404, {"error": "there is nothing here"})
        elif not self._is_for_us() or not self.headers.get("X-Klippy"):
            self._answer(403, NOT_FOR_YOU)
        else:
            self._run(lambda: action(self.server.web, read_request(body)))
