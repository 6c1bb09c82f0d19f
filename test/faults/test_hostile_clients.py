# SPDX-License-Identifier: GPL-3.0-or-later
"""Clients of the API that mean no good, while a print goes on: it does not notice,
and they are cut off."""

import json
import logging
import os
import random
import socket

import pytest
from machine_configs import BED, make_axes

from klippy import waiter

CONFIG = (make_axes("cartesian", extra=BED) + "\n[pause_resume]\n[display_status]\n"
          + "[simulator]\nstart_position: 3, 3, 1\n[virtual_sdcard]\npath: %s\n")
LAYERS = 6
EVERYTHING = {"method": "objects/subscribe", "params": {"interval": 0.01, "objects": {
    name: None for name in ("toolhead", "motion_report", "gcode_move", "extruder",
                            "configfile", "heaters", "mcu", "system_stats")}}}
PAUSE = 0.02        # s, virtual, between two deeds


def write_job(folder):
    """Short moves in a square, layer on layer: the host has work all the time."""
    draw, lines = random.Random(3), ["G90", "M83"]
    for layer in range(LAYERS):
        lines.append("G1 Z%.1f F6000" % (0.2 * (layer + 1),))
        lines += ["G1 X%.3f Y%.3f E.02 F6000" % (
            draw.uniform(50., 60.), draw.uniform(50., 60.)) for _ in range(60)]
    (folder / "job.gcode").write_text("\n".join([*lines, "G1 X5 Y7 Z5"]) + "\n")


@pytest.fixture(autouse=True)
def always_poll(monkeypatch):
    """Sockets are served in every round, whatever the wall clock says."""
    monkeypatch.setattr(waiter, "POLL_INTERVAL", 0.)


class Foe:
    """A connection; attack(foe) is a generator of its deeds."""

    def __init__(self, host, attack):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.setblocking(False)
        self.is_cut_off = False
        try:
            self.sock.connect(str(host.socket_path))
        except BlockingIOError:
            self.is_cut_off = True      # there is no room in the queue
        self.deeds = attack(self)

    def act(self):
        """Do the next deed."""
        if self.is_cut_off:
            return
        try:
            next(self.deeds, None)
        except (BrokenPipeError, ConnectionResetError):
            self.is_cut_off = True

    def send(self, data):
        """Send what fits; returns what is left."""
        try:
            return data[self.sock.send(data):]
        except BlockingIOError:
            return data

    def hears_end(self):
        """True once the host has closed the connection."""
        try:
            return self.is_cut_off or not self.sock.recv(1 << 20)
        except BlockingIOError:
            return False
        except ConnectionResetError:
            return True


def read_nothing(foe):
    foe.send(json.dumps(EVERYTHING).encode() + b"\x03")
    text = json.dumps({"id": 1, "method": "objects/query", "params": {
        "objects": {"configfile": None, "nothing" * 100: None}}}).encode()
    while True:
        foe.send((text + b"\x03") * 5)
        yield


def send_half_a_message(foe):
    foe.send(b'{"id":1,"method":"in')
    while True:
        yield


def send_without_end(foe):
    for _ in range(100 * 16):       # 100 MB, as far as it is taken
        foe.send(b"x" * 65536)
        yield


def send_long_text(foe):
    text = b"\xc3\xa4" * (50 << 20)
    left = b'{"id":1,"method":"info","params":{"x":"' + text + b'"}}\x03'
    while left:
        left = foe.send(left)
        yield


def send_garbage(foe):
    draw = random.Random(5)
    while True:
        foe.send(bytes(draw.choices(range(256), k=500)) + b"\xff\x03")
        yield


def nest_deeply(foe):
    while True:
        foe.send(b'{"id":' + b"[" * 900 + b"]" * 900 + b',"method":"info"}\x03')
        foe.send(b"[" * 50000 + b"\x03")
        yield


def flood(foe):
    left = b""
    while True:
        left = foe.send(left or b'{"method":"objects/list"}\x03' * 3000)
        yield


def hurl_values(foe):
    draw = random.Random(7)
    odd = [None, True, -1, 1e308, "x" * 1000, "\x00\ud800", [], [[]], {}, {"a": {}}]
    names = ("gcode/script", "objects/query", "objects/subscribe", "info",
             "register_remote_method", "gcode/subscribe_output", "nothing",
             "motion_report/dump_trapq", "pause_resume/nothing")
    keys = ("script", "objects", "response_template", "remote_method", "interval",
            "client_info", "name")
    while True:
        params = {key: draw.choice(odd) for key in keys if draw.random() < 0.6}
        if "script" in params:      # a script may do what it says: that is no fault
            params["script"] = draw.choice([None, 5, [], "NO_SUCH_COMMAND"])
        foe.send(json.dumps({"id": draw.choice(odd), "method": draw.choice(names),
                             "params": draw.choice([params, params, *odd])}).encode()
                 + b"\x03")
        foe.hears_end()
        yield


ATTACKS = {     # attack -> whether it ends with the connection
    read_nothing: True, send_half_a_message: False, send_without_end: True,
    send_long_text: True, send_garbage: True, nest_deeply: True, flood: None,
    hurl_values: None}


def count_descriptors():
    return len(os.listdir("/proc/self/fd"))


def print_among(foes_of, make_host, tmp_path):
    """Print the job among foes; returns the foes that were cut off."""
    write_job(tmp_path)
    found = {}

    def body(host):
        host.script("G28")
        host.pause(5.)
        n_stalls, n_before = host.status("toolhead")["stalls"], count_descriptors()
        foes = []
        for attack in foes_of:
            foes.append(Foe(host, attack))
            host.pause(PAUSE)
        host.client.send("gcode/script", script="SDCARD_PRINT_FILE FILENAME=job.gcode")
        for _ in range(int(120. / PAUSE)):
            for foe in foes:
                foe.act()
            host.pause(PAUSE)
            state = host.status("print_stats")["state"]
            if state not in ("standby", "printing"):
                break
        assert state == "complete", host.status("print_stats")
        assert host.status("toolhead")["stalls"] == n_stalls
        assert host.info()["state"] == "ready"
        assert sum(m.late_events for m in host.machine.mcus.values()) == 0
        found.update((foe.deeds.__name__, foe.hears_end()) for foe in foes)
        for foe in foes:
            foe.sock.close()
        host.pause(20.)     # what was sent before the end is still answered
        assert count_descriptors() == n_before
    make_host(CONFIG % (tmp_path,)).run_boots(body)
    return {name for name, is_cut_off in found.items() if is_cut_off}


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_one_foe(make_host, tmp_path, caplog, attack):
    caplog.set_level(logging.INFO)
    cut_off = print_among([attack], make_host, tmp_path)
    if ATTACKS[attack] is not None:
        assert cut_off == ({attack.__name__} if ATTACKS[attack] else set())
    # what it does fills no log either
    size = sum(len(record.getMessage()) for record in caplog.records
               if record.levelno >= logging.WARNING)
    assert size < 20000


def test_all_at_once(make_host, tmp_path):
    cut_off = print_among([*ATTACKS] * 3, make_host, tmp_path)
    assert {attack.__name__ for attack, ends in ATTACKS.items() if ends} <= cut_off


def test_many_connections(make_host, tmp_path):
    assert print_among([send_half_a_message] * 150, make_host, tmp_path)
