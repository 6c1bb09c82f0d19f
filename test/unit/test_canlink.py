# SPDX-License-Identifier: GPL-3.0-or-later
"""The host on a CAN bus, whose other end is the simulator's firmware.

The bus is a pair of sockets that carry frames as a CAN socket does; a thread
behind it is the node.
"""

import pathlib
import socket
import sys
import threading
import types

import pytest

from klippy import canlink
from klippy.extras.system import canbus_ids, canbus_stats
from klippy.reactor import Reactor
from klippy.serialhdl import SerialReader
from klippy_ext.hostclock import RealClock

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "firmware"))
from simboard import SimBoard, build_simulator  # noqa: E402

UUID = bytes.fromhex("0a1b2c3d4e5f")


class Node(SimBoard):
    """A simulated mcu that is a node of the bus; `noise` are frames of others."""

    def __init__(self, library, bus, uuid=UUID):
        self.bus, self.uuid, self.node = bus, uuid, None
        self.partial = b""
        self.frames = []
        super().__init__(library)

    def _tx(self, ctx, clock, buf, size):
        data = bytes(buf[:size])
        # without a number it is silent
        for i in range(0, size if self.node is not None else 0, 8):
            canlink.send_frame(self.bus, 257 + 2 * self.node, data[i:i + 8])

    def serve(self):
        """Take frames until the bus is closed."""
        while True:
            got = self.bus.recv(canlink.FRAME.size)
            if not got:
                return
            can_id, size, data = canlink.FRAME.unpack(got)
            self.take(can_id, data[:size])

    def take(self, can_id, data):
        self.frames.append((can_id, data))
        if can_id == canlink.ADMIN:
            self.administer(data)
        elif self.node is not None and can_id == 256 + 2 * self.node:
            # others talk in between
            canlink.send_frame(self.bus, 257 + 2 * self.node + 2, b"\x7e\x7e")
            self.partial += data
            if data.endswith(b"\x7e"):
                self.ops.rx(self.clock, self.partial, len(self.partial))
                self.partial = b""
                self.run_for(0.001)

    def administer(self, data):
        if data[0] == canlink.QUERY_UNASSIGNED and self.node is None:
            canlink.send_frame(self.bus, 0x123, b"hello")
            canlink.send_frame(self.bus, canlink.ADMIN_REPLY,
                               bytes([0x20]) + self.uuid + bytes([1]))
            canlink.send_frame(self.bus, canlink.ADMIN_REPLY,
                               bytes([0x20]) + bytes(6) + bytes([0x11]))
        elif data[:7] == bytes([canlink.SET_NODE_ID]) + self.uuid:
            self.node = data[7]


@pytest.fixture(scope="module")
def library():
    return build_simulator()


@pytest.fixture
def node(library, monkeypatch):
    """A node on the bus that open_bus() opens."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    opened = []

    def open_bus(interface):
        opened.append(interface)
        bus = ours.dup()
        bus.setblocking(False)
        return bus

    monkeypatch.setattr(canlink, "open_bus", open_bus)
    node = Node(library, theirs)
    node.opened = opened
    thread = threading.Thread(target=node.serve, daemon=True)
    thread.start()
    yield node
    ours.shutdown(socket.SHUT_RDWR)
    thread.join(5.)
    theirs.close()
    ours.close()


def test_query_lists_who_waits(node):
    found = canlink.query_unassigned(canlink.open_bus("can0"), wait=0.3)
    assert found == {UUID: "Klipper", bytes(6): "Katapult"}


def test_connects_and_talks(node):
    """The dictionary and answers, through the real serial queue."""
    reactor = Reactor(RealClock())
    serial = SerialReader(reactor, "toolhead")
    result = []

    def connect(eventtime):
        try:
            serial.connect_canbus(UUID.hex(), 7, "can1")
            command = serial.msgparser.create_command("get_config")
            result.append(serial.query([command], "config"))
        finally:
            serial.disconnect()
            reactor.end()
        return reactor.NEVER

    reactor.register_timer(connect, reactor.NOW)
    reactor.run()
    assert node.node == 7 and node.opened == ["can1"]
    assert result[0]["is_config"] == 0
    assert serial.msgparser.get_constant("MCU")
    sent = {can_id for can_id, _ in node.frames}
    assert sent == {canlink.ADMIN, 256 + 2 * 7}
    assert max(len(data) for _, data in node.frames) == 8


@pytest.mark.parametrize("text", ["", "12345", "0a1b2c3d4e5g", "0a1b2c3d4e5f00"])
def test_bad_uuid(text):
    with pytest.raises(canlink.error, match="12 hex digits"):
        canlink.parse_uuid(text)


def test_unknown_interface():
    with pytest.raises(canlink.error, match="CAN interface 'nocan7'"):
        canlink.open_bus("nocan7")


class FakeConfig:
    """What canbus_ids asks of a section."""

    class error(Exception):
        pass

    def __init__(self, name):
        self.name = name

    def get_name(self):
        return self.name

    def get_printer(self):
        return types.SimpleNamespace(command_error=ValueError)


def test_numbers_of_nodes():
    numbers = canbus_ids.load_config(FakeConfig("mcu"))
    first = numbers.add_uuid(FakeConfig("mcu a"), "0a1b2c3d4e5f", "can0")
    second = numbers.add_uuid(FakeConfig("mcu b"), "0A1B2C3D4E60", "can0")
    other = numbers.add_uuid(FakeConfig("mcu c"), "0a1b2c3d4e61", "can1")
    assert [first, second, other] == [4, 5, 4]
    assert numbers.get_nodeid("0a1b2c3d4e60") == 5
    with pytest.raises(FakeConfig.error, match="another"):
        numbers.add_uuid(FakeConfig("mcu d"), "0a1b2c3d4e5f", "can0")
    with pytest.raises(FakeConfig.error, match="'mcu e'.*12 hex digits"):
        numbers.add_uuid(FakeConfig("mcu e"), "xyz", "can0")
    with pytest.raises(ValueError, match="Unknown"):
        numbers.get_nodeid("0a1b2c3d4e99")
    for i in range(canlink.LAST_NODE - canlink.FIRST_NODE - 1):
        numbers.add_uuid(FakeConfig("mcu n"), "%012x" % (i,), "can0")
    with pytest.raises(FakeConfig.error, match="Too many"):
        numbers.add_uuid(FakeConfig("mcu n"), "ffffffffffff", "can0")


class FakeQuery:
    def __init__(self, answers):
        self.answers = answers

    def send(self):
        return self.answers.pop(0)


class FakeMcu:
    def __init__(self, has_bus=True):
        self.has_bus = has_bus
        self.answers = [
            {"rx_error": 1, "tx_error": 2, "tx_retries": 3, "canbus_bus_state": 1},
            {"rx_error": 4, "tx_error": 5, "tx_retries": 6,
             "canbus_bus_state": "passive"}]

    def try_lookup_command(self, text):
        return self.has_bus or None

    def lookup_query_command(self, text, response):
        return FakeQuery(self.answers)

    def is_fileoutput(self):
        return False


def make_stats(mcu):
    handlers, timers = {}, []
    reactor = types.SimpleNamespace(
        NOW=0., register_timer=lambda cb, when: timers.append(cb) or cb,
        unregister_timer=timers.remove)
    printer = types.SimpleNamespace(
        get_reactor=lambda: reactor, config_error=ValueError,
        register_event_handler=lambda event, cb: handlers.update({event: cb}),
        lookup_object=lambda name, default: mcu if name == "mcu head" else default)
    config = types.SimpleNamespace(get_printer=lambda: printer,
                                   get_name=lambda: "canbus_stats head")
    stats = canbus_stats.load_config_prefix(config)
    return stats, handlers, timers


def test_stats_of_the_bus():
    stats, handlers, timers = make_stats(FakeMcu())
    assert set(stats.get_status(0.).values()) == {None}
    handlers["klippy:connect"]()
    handlers["klippy:ready"]()
    assert timers[0](10.) == 11.
    assert stats.get_status(10.) == {"rx_error": 1, "tx_error": 2, "tx_retries": 3,
                                     "bus_state": "warn"}
    timers[0](11.)
    assert stats.get_status(11.)["bus_state"] == "passive"
    assert "bus_state=passive rx_error=4" in stats.stats(11.)[1]
    handlers["klippy:shutdown"]()
    assert not timers


def test_stats_of_an_mcu_that_is_not_there_or_on_no_bus():
    _, handlers, _ = make_stats(None)
    with pytest.raises(ValueError, match=r"no \[mcu head\]"):
        handlers["klippy:connect"]()
    stats, handlers, timers = make_stats(FakeMcu(has_bus=False))
    handlers["klippy:connect"]()
    handlers["klippy:ready"]()
    assert not timers and stats.get_status(0.)["bus_state"] is None
