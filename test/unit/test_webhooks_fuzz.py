# SPDX-License-Identifier: GPL-3.0-or-later
"""Any JSON, and any bytes, at the API: one answer each, never an internal error."""

import json

import hypothesis
from hypothesis import strategies as st
from test_webhooks import Client, make_api

SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(), st.integers(10 ** 300, 10 ** 400),
    st.floats(), st.text(max_size=20))
VALUES = st.recursive(SCALARS, lambda inner: st.one_of(
    st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner,
                                                 max_size=4)), max_leaves=12)
METHODS = st.sampled_from([
    "info", "list_endpoints", "objects/list", "objects/query", "objects/subscribe",
    "register_remote_method", "gcode/subscribe_output", "gcode/help", "gcode/script",
    "nothing"])
KEYS = st.sampled_from(["objects", "response_template", "interval", "remote_method",
                        "client_info", "id"])
NAMES = st.one_of(st.sampled_from(["thing", "webhooks", "gcode"]), st.text(max_size=5))
WANTED = st.dictionaries(NAMES, st.one_of(
    st.none(), st.lists(st.text(max_size=4), max_size=3), VALUES), max_size=4)
SUBSCRIPTION = st.fixed_dictionaries({"objects": WANTED}, optional={
    "interval": SCALARS, "response_template": st.dictionaries(
        st.text(max_size=8), VALUES, max_size=3)})
PARAMS = st.one_of(VALUES, SUBSCRIPTION, st.dictionaries(
    KEYS, st.one_of(VALUES, WANTED), max_size=5))
REQUESTS = st.one_of(st.tuples(METHODS, PARAMS),
                     st.tuples(st.just("objects/subscribe"), SUBSCRIPTION))
FEW = hypothesis.settings(
    max_examples=100, deadline=None, derandomize=True,
    suppress_health_check=[hypothesis.HealthCheck.function_scoped_fixture])


@FEW
@hypothesis.given(requests=st.lists(REQUESTS, max_size=15))
def test_every_request_has_one_answer(tmp_path_factory, requests):
    path = tmp_path_factory.mktemp("api") / "sock"
    printer, api = make_api(path)
    printer.make_ready()
    client = Client(printer, path)
    for number, (method, params) in enumerate(requests):
        client.send(id=number, method=method, params=params)
        printer.run_for(0.01)
    printer.lookup_object("thing").status["a"] = 9
    printer.gcode.respond_raw("text")
    printer.run_for(1.)
    replies = [m for m in client.read() if isinstance(m, dict) and "params" not in m]
    answered = [m for m in replies if "result" in m or "error" in m]
    assert [reply["id"] for reply in answered] == list(range(len(requests)))
    for reply in answered:
        assert "internal error" not in reply.get("error", {}).get("message", "")
    client.sock.close()
    printer.close()


@FEW
@hypothesis.given(data=st.lists(st.one_of(
    st.binary(max_size=200), VALUES.map(lambda value: json.dumps(value).encode()),
    st.just(b"\x03")), max_size=30))
def test_any_bytes(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("api") / "sock"
    printer, api = make_api(path)
    printer.make_ready()
    foe, friend = Client(printer, path), Client(printer, path)
    for part in data:
        try:
            foe.sock.sendall(part)
        except BrokenPipeError:
            break       # cut off
        printer.run_for(0.01)
    assert friend.ask("info")["state"] == "ready"
    for client in (foe, friend):
        client.sock.close()
    printer.close()
