# SPDX-License-Identifier: GPL-3.0-or-later
"""What subscribers cost: a round for 20 clients that follow 1,000 fields each.

Four rounds a second: the share of a core is 4 times the median.
"""

import json
import socket

import pytest
from front_end import Printer

from klippy import webhooks

N_CLIENTS, N_OBJECTS, N_FIELDS = 20, 50, 20
MOVING = 5                  # fields of each object that change each round


class Thing:
    """A printer object of which a quarter changes all the time."""

    def __init__(self):
        self.round = 0

    def get_status(self, eventtime):
        self.round += 1
        status = {"moving_%d" % (n,): self.round + n / 7. for n in range(MOVING)}
        status.update(("still_%d" % (n,), [n, "text", 1.5])
                      for n in range(N_FIELDS - MOVING))
        return status


def make_subscribers(path, is_shared):
    """(printer, sockets) with everybody subscribed."""
    printer = Printer(apiserver=str(path))
    webhooks.setup(printer)
    names = ["thing_%d" % (n,) for n in range(N_OBJECTS)]
    for name in names:
        printer.add_object(name, Thing())
    printer.make_ready()
    sockets = []
    for number in range(N_CLIENTS):
        sock = socket.socket(socket.AF_UNIX)
        sock.connect(str(path))
        wanted = dict.fromkeys(names)
        if not is_shared:
            wanted["other_%d" % (number,)] = None
        sock.sendall(json.dumps({"method": "objects/subscribe", "params": {
            "objects": wanted}}).encode() + b"\x03")
        sockets.append(sock)
        printer.run_for(0.05)
    printer.run_for(1.)
    return printer, sockets


@pytest.mark.parametrize("is_shared", [True, False], ids=["same", "different"])
def test_round_of_subscriptions(benchmark, tmp_path, is_shared):
    printer, sockets = make_subscribers(tmp_path / "api", is_shared)
    status = printer.lookup_object("webhooks").objects
    assert len(status.followers) == (1 if is_shared else N_CLIENTS)

    def read_all():
        for sock in sockets:
            sock.recv(1 << 20)

    def run_round():
        status._send_changes(max(f.next_time for f in status.followers))
    benchmark.pedantic(run_round, setup=read_all, rounds=40)
    printer.close()
