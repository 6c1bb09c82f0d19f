# SPDX-License-Identifier: GPL-3.0-or-later
"""What the service manager hears, at a socket as systemd has one."""

import os
import socket

import pytest
from front_end import make_printer

from klippy.sdnotify import Notifier


@pytest.fixture(params=["file", "abstract"])
def manager(request, tmp_path):
    """(address for NOTIFY_SOCKET, socket of the manager)."""
    name = str(tmp_path / "notify")
    if request.param == "abstract":
        name = "@" + name
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    sock.bind(name.replace("@", "\0"))
    sock.setblocking(False)
    yield name, sock
    sock.close()


def hear(sock):
    """All messages so far, as dicts."""
    found = []
    while True:
        try:
            data = sock.recv(4096)
        except BlockingIOError:
            return found
        found.append(dict(line.split("=", 1) for line in data.decode().split("\n")))


def test_tells_state_and_signs_of_life(manager):
    address, sock = manager
    notifier = Notifier({"NOTIFY_SOCKET": address, "WATCHDOG_USEC": "9000000",
                         "WATCHDOG_PID": str(os.getpid())})
    printer = make_printer()
    printer.get_state_message = lambda: ("Option 'x' is wrong\nin line 5", "error")
    notifier.watch(printer)
    printer.run_for(0.1)
    first, = hear(sock)
    assert first["READY"] == "1" and first["WATCHDOG"] == "1"
    assert first["STATUS"] == "error: Option 'x' is wrong"
    printer.run_for(30.)
    assert 9 <= len(hear(sock)) <= 11           # a third of what is allowed
    notifier.send(STOPPING=1)
    assert hear(sock) == [{"STOPPING": "1"}]
    notifier.close()
    printer.close()


def test_another_state_is_told_within_a_second(manager):
    address, sock = manager
    notifier = Notifier({"NOTIFY_SOCKET": address, "WATCHDOG_USEC": "90000000"})
    printer = make_printer()
    state = ["startup"]
    printer.get_state_message = lambda: ("Text", state[0])
    notifier.watch(printer)
    printer.run_for(0.1)
    state[0] = "ready"
    printer.run_for(1.1)
    assert [m["STATUS"] for m in hear(sock)] == ["startup: Text", "ready: Text"]
    printer.run_for(20.)
    assert hear(sock) == []
    notifier.close()
    printer.close()


def test_watchdog_of_another_process_is_not_served(manager):
    address, sock = manager
    notifier = Notifier({"NOTIFY_SOCKET": address, "WATCHDOG_USEC": "1000000",
                         "WATCHDOG_PID": "1"})
    printer = make_printer()
    notifier.watch(printer)
    printer.run_for(5.)
    messages = hear(sock)
    assert messages and not any("WATCHDOG" in message for message in messages)
    notifier.close()
    printer.close()


def test_manager_that_is_gone_or_does_not_listen(manager, caplog):
    address, sock = manager
    notifier = Notifier({"NOTIFY_SOCKET": address})
    for _ in range(5000):
        notifier.send(STATUS="x" * 1000)        # more than its queue holds
    sock.close()
    notifier.send(STATUS="y")
    notifier.send(STATUS="z")
    assert len(caplog.records) == 1 and "does not listen" in caplog.text


def test_no_manager():
    notifier = Notifier({})
    printer = make_printer()
    notifier.watch(printer)
    notifier.send(READY=1)
    notifier.close()
    printer.close()
