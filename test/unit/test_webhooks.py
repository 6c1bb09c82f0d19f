# SPDX-License-Identifier: GPL-3.0-or-later
"""The API over a real Unix socket, in the virtual time of the reactor."""

import itertools
import json
import math
import os
import socket

import pytest
from front_end import Printer, make_printer

from klippy import api_socket, webhooks
from klippy.errors import CommandError, ConfigError, McuError, Place


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


def test_info_lists_the_errors_of_the_config(client, printer):
    assert client.ask("info")["errors"] == []
    printer.load_errors = [ConfigError("Option 'x' is wrong", Place("a.cfg", 5)),
                           McuError("no answer")]
    printer.get_state_message = lambda: ("a.cfg:5: Option 'x' is wrong", "error")
    unknown = dict.fromkeys(("column", "section", "option", "nearest"))
    assert client.ask("info")["errors"] == [
        {"kind": "ConfigError", "message": "Option 'x' is wrong", "file": "a.cfg",
         "line": 5, **unknown},
        {"kind": "McuError", "message": "no answer", "file": None, "line": None,
         **unknown}]


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


# Rates, sharing, bounds

def follow(client, number, interval=None, fields=None):
    """Subscribe to `thing`, with a template that tells the client's number."""
    params = {"objects": {"thing": fields}, "response_template": {"key": number}}
    if interval is not None:
        params["interval"] = interval
    return client.ask("objects/subscribe", **params)


def test_rate_on_request(client, printer):
    thing = printer.lookup_object("thing")
    follow(client, 1, interval=0.05)
    for step in range(200):
        thing.status["a"] = step + 10
        printer.run_for(0.01)
    assert 38 <= len(client.take(0.)) <= 42
    follow(client, 1, interval=10.)
    thing.status["a"] = 5
    assert client.take(0.) == []
    assert len(client.take(10.1)) == 1
    for interval in (0., -1., 1e300, float("nan")):
        assert "is 0.01 to 3600 s" in follow(client, 1, interval=interval)["message"]
    assert "is too large" in follow(client, 1, interval=10 ** 400)["message"]
    assert "must be of type" in follow(client, 1, interval="x")["message"]


def test_clients_that_follow_the_same_share_the_work(client, printer, path):
    thing, reads = printer.lookup_object("thing"), [0]
    read = thing.get_status

    def count(eventtime):
        reads[0] += 1
        return read(eventtime)
    thing.get_status = count
    others = [Client(printer, path) for _ in range(5)]
    follow(client, 0)
    for number, other in enumerate(others):
        printer.run_for(0.03)
        thing.status["a"] = 100 + number        # the others know older values
        assert follow(other, number + 1)["status"]["thing"]["a"] == 100 + number
    printer.run_for(0.5)
    status_api = printer.lookup_object("webhooks").objects
    assert len(status_api.followers) == 1
    reads[0] = 0
    for peer in (client, *others):
        peer.read()
    thing.status["a"] = 7
    printer.run_for(0.25)
    assert reads[0] == 1
    for number, peer in enumerate((client, *others)):
        change, = peer.read()
        assert change["key"] == number and change["params"]["status"] == {
            "thing": {"a": 7}}
    for other in others:
        other.sock.close()
    printer.run_for(0.5)
    assert len(status_api.followers[0].templates) == 1


def test_other_fields_and_rates_stay_apart(client, printer, path):
    other = Client(printer, path)
    follow(client, 1, fields=["a"])
    follow(other, 2, fields=["b"])
    printer.run_for(0.5)
    thing = printer.lookup_object("thing")
    thing.status["b"] = [3]
    assert client.take(0.3) == []
    change, = other.take(0.)
    assert change["params"]["status"] == {"thing": {"b": [3]}}
    other.sock.close()


def test_requests_take_turns_with_everything_else(client, printer):
    seen, counts = [0], []
    printer.lookup_object("webhooks").register_endpoint(
        "count", lambda request: seen.__setitem__(0, seen[0] + 1))
    reactor = printer.reactor

    def tick(eventtime):
        counts.append(seen[0])
        return eventtime + 0.001
    reactor.register_timer(tick, reactor.NOW)
    client.sock.sendall(b'{"method":"count"}\x03' * 2000)
    printer.run_for(3.)
    assert seen[0] == 2000
    assert max(b - a for a, b in itertools.pairwise(counts)) <= 4


def test_who_asks_too_much_is_not_read(client, printer):
    printer.run_for(0.1)
    connection, = printer.lookup_object("webhooks").server.clients
    sent = 0
    with pytest.raises(BlockingIOError):
        while True:
            sent += client.sock.send(b'{"method":"list_endpoints"}\x03' * 1000)
            printer.run_for(0.001)
    assert len(connection.pending) < 10000 and len(connection.input) < 1000000
    printer.run_for(60.)
    assert not connection.pending
    assert client.ask("info")["state"] == "ready"


def test_too_many_waiting_requests_are_refused(client, printer, monkeypatch):
    monkeypatch.setattr(api_socket, "MAX_RUNNING", 5)
    printer.gcode.register_command("WAIT", lambda gcmd: printer.reactor.pause(
        printer.reactor.monotonic() + 60.))
    for number in range(8):
        client.send(id=number, method="gcode/script", params={"script": "WAIT"})
    replies = client.take(0.5)
    assert [reply["id"] for reply in replies] == [5, 6, 7]
    assert "too many requests" in replies[0]["error"]["message"]
    client.send(id=9, method="emergency_stop")
    assert [reply["id"] for reply in client.take(0.5)] == [9]
    assert printer.state == "shutdown"


def test_too_much_that_is_not_json_is_cut_off(client, printer, caplog):
    client.sock.sendall(b"\xff{\x03" * 50)
    printer.run_for(1.)
    assert not printer.lookup_object("webhooks").server.clients
    assert "cut off: 11 requests that are not JSON" in caplog.text
    assert len(caplog.records) < 20


def test_too_many_clients_are_turned_away(client, printer, path, monkeypatch):
    monkeypatch.setattr(api_socket, "MAX_CLIENTS", 3)
    others = [Client(printer, path) for _ in range(6)]
    printer.run_for(5.5)
    assert len(printer.lookup_object("webhooks").server.clients) == 3
    assert client.ask("info")["state"] == "ready"
    for other in others:
        other.sock.close()
    printer.run_for(1.5)
    again = Client(printer, path)
    assert again.ask("info")["state"] == "ready"
    again.sock.close()


@pytest.mark.parametrize("message", [
    {"id": [[1]], "method": "info"}, {"id": {}, "method": "info"}])
def test_an_id_is_no_structure(client, message):
    client.send(**message)
    assert client.take() == []
    assert client.ask("info")["state"] == "ready"


def test_odd_status_is_sent_all_the_same(client, printer):
    endless = []
    endless.append(endless)
    thing = printer.lookup_object("thing")
    thing.status = {"pair": {(1, 2): 3}, "nan": math.nan}
    assert client.ask("objects/query", objects={"thing": None})["status"] == {
        "thing": {"pair": {"(1, 2)": 3}, "nan": None}}
    thing.status = {"endless": endless, "a": 1}
    assert client.ask("objects/query", objects={"thing": None})["status"] == {
        "thing": {"endless": [None], "a": 1}}


def test_one_long_answer_is_no_reason(client, printer, monkeypatch):
    monkeypatch.setattr(api_socket, "MAX_OUTPUT", 10000)
    printer.lookup_object("thing").status["a"] = "x" * 3000000
    client.send(id=1, method="objects/query", params={"objects": {"thing": ["a"]}})
    seen = []
    for _ in range(100):
        seen += client.take(0.01)
    assert len(seen) == 1 and len(seen[0]["result"]["status"]["thing"]["a"]) == 3000000


def test_arrays_in_a_status(client, printer):
    numpy = pytest.importorskip("numpy")
    thing = printer.lookup_object("thing")
    thing.status = {"row": numpy.array([1., 2.])}
    assert follow(client, 1)["status"] == {"thing": {"row": [1., 2.]}}
    thing.status = {"row": numpy.array([1., 3.])}
    change, = client.take(0.3)
    assert change["params"]["status"] == {"thing": {"row": [1., 3.]}}
