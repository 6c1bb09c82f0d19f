# SPDX-License-Identifier: GPL-3.0-or-later
"""The API over a real Unix socket, in the virtual time of the reactor."""

import json
import math
import os
import socket

import pytest
from front_end import Printer, make_printer

from klippy import api_socket, webhooks
from klippy.errors import CommandError, ConfigError


class Client:
    """A peer of the API socket in the same thread."""

    def __init__(self, printer, path):
        self.printer, self.pending = printer, b""
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.connect(str(path))
        self.sock.setblocking(False)

    def send(self, **message):
        self.sock.sendall(json.dumps(message).encode() + b"\x03")

    def take(self, seconds=0.1):
        """Messages that arrive within some virtual time."""
        self.printer.run_for(seconds)
        return self.read()

    def read(self):
        """Messages that have arrived."""
        while True:
            try:
                data = self.sock.recv(1 << 20)
            except BlockingIOError:
                break
            if not data:
                break
            self.pending += data
        *messages, self.pending = self.pending.split(b"\x03")
        return [json.loads(text) for text in messages]

    def ask(self, method, **params):
        self.send(id=7, method=method, params=params)
        replies = [m for m in self.take() if m.get("id") == 7]
        assert len(replies) == 1
        return replies[0].get("result", replies[0].get("error"))


class Thing:
    """A printer object with status."""

    def __init__(self):
        self.status = {"a": 1, "b": [1, 2]}

    def get_status(self, eventtime):
        return dict(self.status)


class Broken:
    def get_status(self, eventtime):
        raise KeyError("broken")


def make_api(path, **start_args):
    printer = Printer(apiserver=str(path), software_version="v1",
                      config_file="printer.cfg", log_file=None, cpu_info="cpu",
                      **start_args)
    api = webhooks.setup(printer)
    printer.add_object("thing", Thing())
    return printer, api


@pytest.fixture
def path(tmp_path):
    return tmp_path / "api.sock"


@pytest.fixture
def printer(path):
    printer, _ = make_api(path)
    printer.make_ready()
    yield printer
    printer.close()


@pytest.fixture
def client(printer, path):
    peer = Client(printer, path)
    yield peer
    peer.sock.close()


def test_info_and_endpoints(client):
    info = client.ask("info", client_info={"program": "Test", "version": "1"})
    assert info["state"] == "ready" and info["software_version"] == "v1"
    assert {"state_message", "hostname", "klipper_path", "python_path", "process_id",
            "user_id", "group_id", "log_file", "config_file", "cpu_info",
            "app"} < set(info)
    assert os.path.isdir(os.path.join(info["klipper_path"], "docs"))
    endpoints = client.ask("list_endpoints")["endpoints"]
    assert {"info", "emergency_stop", "gcode/script", "objects/query",
            "register_remote_method", "gcode/subscribe_output"} < set(endpoints)


def test_gcode_endpoints(client, printer):
    client.send(method="gcode/subscribe_output",
                params={"response_template": {"method": "out"}})
    client.take()
    client.send(id=1, method="gcode/script", params={"script": "ECHO x"})
    assert client.take() == [
        {"method": "out", "params": {"response": "// ECHO x"}},
        {"id": 1, "result": {}}]
    assert "RESTART" in client.ask("gcode/help")
    error = client.ask("gcode/script", script="\1")
    assert error["error"] == "CommandError" and "is no G-code" in error["message"]
    assert client.ask("gcode/script")["message"] == (
        "gcode/script needs the parameter 'script'")


@pytest.mark.parametrize("method, result", [
    ("gcode/restart", "restart"), ("gcode/firmware_restart", "firmware_restart")])
def test_restart_is_answered_before_the_socket_closes(client, printer, method, result):
    client.send(id=1, method=method)
    printer.run_for(0.1)
    assert printer.exit_result == result
    printer.send_event("klippy:disconnect")
    assert client.read() == [{"id": 1, "result": {}}]
    assert client.sock.recv(10) == b""


def test_emergency_stop_answers_at_once(client, printer):
    assert client.ask("emergency_stop") == {}
    assert client.ask("info")["state"] == "shutdown"


def test_query_and_list(client, printer):
    printer.add_object("broken", Broken())
    assert client.ask("objects/list")["objects"] == [
        "gcode", "webhooks", "thing", "broken"]
    answer = client.ask("objects/query", objects={
        "thing": ["a", "none"], "webhooks": None, "unknown": None, "broken": None})
    assert answer["status"] == {
        "thing": {"a": 1, "none": None}, "unknown": {}, "broken": {},
        "webhooks": {"state": "ready", "state_message": "Printer is ready"}}
    assert "list of names" in client.ask(
        "objects/query", objects={"thing": "a"})["message"]
    assert "must be of type dict" in client.ask(
        "objects/query", objects=[1])["message"]


def test_subscription_sends_only_changes(client, printer):
    thing = printer.lookup_object("thing")
    client.send(id=2, method="objects/subscribe", params={
        "objects": {"thing": None}, "response_template": {"key": 9}})
    first, = client.take(0.1)
    assert first["result"]["status"] == {"thing": {"a": 1, "b": [1, 2]}}
    assert client.take(2.) == []
    thing.status["a"] = 5
    change, = client.take(1.)
    assert change["key"] == 9 and change["params"]["status"] == {"thing": {"a": 5}}
    for step in range(50):
        thing.status["b"] = [step]
        printer.run_for(0.02)
    assert 3 <= len(client.take(0.01)) <= 5
    client.send(id=3, method="objects/subscribe", params={"objects": {}})
    client.take(0.5)
    thing.status["a"] = 6
    assert client.take(1.) == []


def test_query_is_answered_while_a_script_runs(client, printer):
    printer.gcode.register_command("WAIT", lambda gcmd: printer.reactor.pause(
        printer.reactor.monotonic() + 60.))
    client.send(id=1, method="gcode/script", params={"script": "WAIT"})
    client.send(id=2, method="objects/query", params={"objects": {"thing": ["a"]}})
    replies = client.take(0.1)
    assert [reply["id"] for reply in replies] == [2]
    printer.run_for(70.)
    assert client.read() == [{"id": 1, "result": {}}]


@pytest.mark.parametrize("data", [
    b"{", b"\xff\xfe", b"[" * 100000, b"", b"1" * 5000])
def test_what_is_not_json_is_dropped(client, data, printer):
    client.sock.sendall(data + b"\x03")
    assert client.take() == []
    assert client.ask("info")["state"] == "ready"


@pytest.mark.parametrize("message, text", [
    ({"id": 7}, "needs a text 'method'"),
    ({"id": 7, "method": 5}, "needs a text 'method'"),
    ({"id": 7, "method": "nope"}, "no method 'nope'"),
    ({"id": 7, "method": "info", "params": [1]}, "'params' is a JSON object"),
    ({"id": 7, "method": "info", "params": {"client_info": 1}}, "type dict"),
])
def test_wrong_requests_are_answered(client, message, text):
    client.send(**message)
    reply, = client.take()
    assert text in reply["error"]["message"]
    assert reply["error"]["error"] == "WebRequestError"


def test_request_in_pieces_and_without_id(client, printer):
    client.sock.sendall(b'{"id":1,"meth')
    assert client.take() == []
    client.sock.sendall(b'od":"gcode/help"}\x03{"method":"gcode/help"}\x03{"id":2,')
    assert [reply["id"] for reply in client.take()] == [1]


def test_defect_of_an_endpoint_is_answered(client, printer, caplog):
    def fail(web_request):
        raise ZeroDivisionError("oops")
    printer.lookup_object("webhooks").register_endpoint("fail", fail)
    assert client.ask("fail")["message"] == "internal error: ZeroDivisionError: oops"
    assert "internal error" in caplog.text


def test_client_that_does_not_read_is_cut_off(client, printer, monkeypatch, caplog):
    monkeypatch.setattr(api_socket, "MAX_OUTPUT", 1 << 20)
    client.send(method="gcode/subscribe_output", params={})
    printer.run_for(0.1)
    server = printer.lookup_object("webhooks").server
    for _ in range(40):
        printer.gcode.respond_raw("x" * 100000)
    assert not server.clients and "cut off" in caplog.text
    printer.gcode.respond_raw("nobody listens")


def test_slow_client_gets_everything(client, printer):
    client.send(method="gcode/subscribe_output", params={})
    printer.run_for(0.1)
    for number in range(20):
        printer.gcode.respond_raw("%d" % number + "x" * 100000)
    seen = []
    for _ in range(100):
        seen += client.take(0.01)
    assert [int(m["params"]["response"].rstrip("x")) for m in seen] == list(range(20))


def test_oversized_request_is_cut_off(client, printer, monkeypatch, caplog):
    monkeypatch.setattr(api_socket, "MAX_INPUT", 100000)
    client.sock.sendall(b"x" * 150000)
    printer.run_for(0.1)
    printer.run_for(0.1)
    printer.run_for(0.1)
    assert not printer.lookup_object("webhooks").server.clients
    assert "cut off" in caplog.text


def test_remote_methods(client, printer):
    api = printer.lookup_object("webhooks")
    with pytest.raises(CommandError, match="'beep' is not registered"):
        api.call_remote_method("beep")
    assert client.ask("register_remote_method", remote_method="beep",
                      response_template={"method": "b"}) == {}
    api.call_remote_method("beep", tone=5)
    assert client.take() == [{"method": "b", "params": {"tone": 5}}]
    client.sock.close()
    printer.run_for(0.1)
    with pytest.raises(CommandError, match="No client"):
        api.call_remote_method("beep")


def test_mux_endpoints(client, printer):
    api = printer.lookup_object("webhooks")
    api.register_mux_endpoint("dump", "sensor", "a", lambda r: r.send({"from": "a"}))
    api.register_mux_endpoint("dump", "sensor", "b", lambda r: r.send({"from": "b"}))
    assert client.ask("dump", sensor="b") == {"from": "b"}
    assert "no sensor 'c'" in client.ask("dump", sensor="c")["message"]
    assert "no sensor [1]" in client.ask("dump", sensor=[1])["message"]
    assert "needs the parameter 'sensor'" in client.ask("dump")["message"]
    for args in (("dump", "name", "a"), ("dump", "sensor", "a")):
        with pytest.raises(ConfigError):
            api.register_mux_endpoint(*args, print)
    with pytest.raises(ConfigError, match="already registered"):
        api.register_endpoint("dump", print)


def test_types_of_parameters():
    request = webhooks.WebRequest(None, {"method": "m", "params": {
        "i": 5, "f": .5, "s": "x", "b": True, "l": [1], "n": None}})
    assert request.get_int("i") == 5 and request.get_float("i") == 5.
    assert request.get_float("f") == .5 and request.get_str("s") == "x"
    assert request.get_list("l") == [1] and request.get("b") is True
    assert request.get_str("absent", "d") == "d" and request.get_str("n", None) is None
    for name, read in (("b", request.get_int), ("f", request.get_int),
                       ("i", request.get_str), ("n", request.get_dict)):
        with pytest.raises(webhooks.WebRequestError, match="must be of type"):
            read(name)
    request.send({"x": 1})
    assert request.finish() == {"x": 1}
    with pytest.raises(webhooks.WebRequestError, match="answered already"):
        request.send({})


def test_encoding_never_fails():
    message = {"a": math.inf, "b": (1, math.nan), "c": {3}, "d": object, 5: "\ud800"}
    decoded = json.loads(api_socket.encode_message(message)[:-1])
    assert decoded["a"] is None and decoded["b"] == [1, None] and decoded["c"] == [3]


def test_stale_socket_is_replaced_other_files_are_not(path):
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(path))
    left.close()
    printer, _ = make_api(path)
    printer.close()
    assert not path.exists()
    path.write_text("precious")
    with pytest.raises(ConfigError, match="Unable to open the API socket"):
        make_api(path)
    assert path.read_text() == "precious"


def test_no_socket_without_path():
    printer = make_printer()
    webhooks.setup(printer)
    printer.close()
