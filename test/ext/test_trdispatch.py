# SPDX-License-Identifier: GPL-3.0-or-later
"""Triggers passed between mcus: against slow peers, and on the firmware."""

import ctypes
import pathlib
import socket

import pytest
from linkpeers import SlowPeer, read_ints, slow_int

import klippy_ext
from klippy.msgproto import MessageParser
from klippy.simulator import firmware
from klippy_ext.hostclock import RealClock
from klippy_ext.serialqueue import CommandQueue, SerialQueue
from klippy_ext.trdispatch import TrDispatch
from klippy_ext.vworld import VirtualWorld

TIMEOUT_TAG, TRIGGER_TAG, STATE_TAG = 130, 40, 61
FREQS = (16e6, 20e6)


class Side:
    """One mcu with a trigger: its queue, its peer, its member."""

    def __init__(self, dispatch, oid, freq):
        self.host, mcu = socket.socketpair()
        self.peer = SlowPeer(mcu)
        self.oid = oid
        self.queue = SerialQueue.open_fd(RealClock(), self.host.fileno(), "serial")
        self.queue.set_clock_est(freq, 1000., 0, 5000)
        self.member = dispatch.add(self.queue, CommandQueue(), oid, TIMEOUT_TAG,
                                   TRIGGER_TAG, STATE_TAG)

    def report(self, can_trigger, clock, oid=None, tag=STATE_TAG):
        values = (tag, self.oid if oid is None else oid, can_trigger, 1, clock)
        self.peer.send(b"".join(map(slow_int, values)))
        # what pull() gives, the readers have seen
        assert read_ints(self.queue.pull()[0], 5)[0] == [v & 0xFFFFFFFF for v in values]

    def read_command(self):
        while True:
            payload = self.peer.serve_block()
            assert payload is not None, "nothing was sent"
            if payload:
                return read_ints(payload, 3)[0]

    def close(self):
        assert self.peer.pending == b""
        self.queue.close()
        self.host.close()
        self.peer.sock.close()


@pytest.fixture
def sides():
    dispatch = TrDispatch(RealClock())
    made = [Side(dispatch, 3 + i, freq) for i, freq in enumerate(FREQS)]
    yield dispatch, made
    dispatch.stop()
    for side in made:
        side.close()


def setup(sides):
    for side, freq in zip(sides, FREQS, strict=True):
        side.member.setup(0, int(0.1 * freq), int(0.03 * freq))


def is_quiet(side):
    stats = side.queue.get_stats()
    return stats["upcoming_bytes"] == stats["ready_bytes"] == 0 and (
        stats["send_seq"] == stats["receive_seq"])


def test_trigger_goes_to_the_others_once(sides):
    dispatch, (first, second) = sides
    setup((first, second))
    dispatch.start(7)
    first.report(0, 1000)
    assert second.read_command() == [TRIGGER_TAG, second.oid, 7]
    second.report(0, 1000)
    first.report(0, 2000)
    assert is_quiet(first) and is_quiet(second)


def test_only_its_own_reports_count(sides):
    dispatch, (first, second) = sides
    setup((first, second))
    first.report(0, 1000)
    dispatch.start(7)
    first.report(0, 1000, oid=first.oid + 1)
    first.report(0, 1000, tag=STATE_TAG + 1)
    first.peer.send(slow_int(STATE_TAG) + slow_int(first.oid))
    first.queue.pull()
    assert is_quiet(second)
    dispatch.stop()
    first.report(0, 1000)
    assert is_quiet(first) and is_quiet(second)


def test_timeouts_follow_the_slowest(sides):
    """All expire 0.1 s after the oldest of the last reports, in own ticks."""
    dispatch, (first, second) = sides
    setup((first, second))
    dispatch.start(7)
    first.report(1, int(0.05 * FREQS[0]))
    assert is_quiet(first) and is_quiet(second)
    second.report(1, int(0.04 * FREQS[1]))
    commands = [side.read_command() for side in (first, second)]
    for side, freq, command in zip((first, second), FREQS, commands, strict=True):
        assert command[:2] == [TIMEOUT_TAG, side.oid]
        assert command[2] == pytest.approx(0.14 * freq, abs=2)
    # less than the least extension: nothing is sent
    second.report(1, int(0.06 * FREQS[1]))
    first.report(1, int(0.06 * FREQS[0]))
    assert is_quiet(first) and is_quiet(second)
    second.report(1, int(0.09 * FREQS[1]))
    first.report(1, int(0.08 * FREQS[0]))
    assert first.read_command()[2] == pytest.approx(0.18 * FREQS[0], abs=2)
    assert second.read_command()[2] == pytest.approx(0.18 * FREQS[1], abs=2)


def test_start_again_with_other_reason(sides):
    dispatch, (first, second) = sides
    for reason in (2, 5):
        setup((first, second))
        dispatch.start(reason)
        second.report(0, 100)
        assert first.read_command() == [TRIGGER_TAG, first.oid, reason]
        dispatch.stop()


def test_member_outlives_dispatch(sides):
    member = TrDispatch().add(sides[1][0].queue, CommandQueue(), 1, 2, 3, 4)
    with pytest.raises(RuntimeError, match="gone"):
        member.setup(0, 1, 1)


def test_foreign_trdispatch(sides):
    """What a plug-in allocates itself through the C surface works the same."""
    folder = pathlib.Path(next(iter(klippy_ext.__path__)))
    lib = ctypes.CDLL(str(folder / "libklippyc.so"))
    lib.trdispatch_alloc.restype = ctypes.c_void_p
    lib.trdispatch_start.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
    lib.trdispatch_stop.argtypes = [ctypes.c_void_p]
    pointer = lib.trdispatch_alloc()
    dispatch = TrDispatch.from_pointer(pointer)
    first, second = Side(dispatch, 1, 1e6), Side(dispatch, 2, 1e6)
    for side in (first, second):
        side.member.setup(0, 1000, 300)
    lib.trdispatch_start(pointer, 9)
    first.report(0, 10)
    assert second.read_command() == [TRIGGER_TAG, 2, 9]
    lib.trdispatch_stop(pointer)
    for side in (first, second):
        side.close()
    with pytest.raises(ValueError, match="NULL"):
        TrDispatch.from_pointer(0)


# On the real firmware, in virtual time


class Board:
    """A simulator firmware with one trigger."""

    OID = 0

    def __init__(self, world, name, ppm):
        self.world = world
        self.mcu = world.add_mcu(name, firmware.find_firmware(), ppm=ppm, seed=1)
        self.queue = SerialQueue.open_virtual(world, self.mcu.link)
        self.cq = CommandQueue()
        self.parser = MessageParser()
        self.parser.process_identify(self.fetch())
        self.states = []
        now = world.monotonic()
        clock = self.mcu.clock_at(now)
        self.queue.set_clock_est(self.mcu.freq * (1. + ppm * 1e-6), now, clock, clock)
        self.send("allocate_oids count=1")
        self.send("config_trsync oid=0")

    def send(self, text):
        self.queue.send(self.cq, self.parser.create_command(text))

    def fetch(self):
        data = b""
        while True:
            self.queue.send(self.cq, b"\x01" + slow_int(len(data)) + b"\x28")
            chunk = None
            while chunk is None:
                self.world.advance(self.world.monotonic() + 1.)
                while (entry := self.queue.pull()) is not None:
                    if entry[0][:1] == b"\0":
                        pos = read_ints(entry[0], 2)[1]
                        chunk = entry[0][pos + 1:]
            if not chunk:
                return data
            data += chunk

    def tag(self, name):
        text = {"state": "trsync_state oid=0 can_trigger=0 trigger_reason=0 clock=0",
                "timeout": "trsync_set_timeout oid=0 clock=0",
                "trigger": "trsync_trigger oid=0 reason=0"}[name]
        if name != "state":
            return read_ints(self.parser.create_command(text), 1)[0][0]
        return next(i for i, m in self.parser.messages_by_id.items()
                    if m.name == "trsync_state")

    def join(self, dispatch):
        self.member = dispatch.add(
            self.queue, self.cq, self.OID, self.tag("timeout"), self.tag("trigger"),
            self.tag("state"))

    def arm(self, start, timeout, phase):
        clock = self.mcu.clock_at(start)
        ticks = int(timeout * self.mcu.freq)
        report = int(ticks * 0.3)
        self.member.setup(clock, ticks, report)
        self.send("trsync_start oid=0 report_clock=%d report_ticks=%d expire_reason=4"
                  % ((clock + int(report * phase)) & 0xFFFFFFFF, report))
        self.send("trsync_set_timeout oid=0 clock=%d" % ((clock + ticks) & 0xFFFFFFFF))

    def collect(self):
        while (entry := self.queue.pull()) is not None:
            for params in self.parser.parse_payload(entry[0]):
                if params["#name"] == "trsync_state":
                    self.states.append((entry[2], params))

    def find_trigger(self):
        """(time, reason) of the first report that it has triggered."""
        return next(((time, p["trigger_reason"]) for time, p in self.states
                     if not p["can_trigger"]), None)


@pytest.fixture
def boards():
    world = VirtualWorld(seed=8)
    made = [Board(world, n, p) for n, p in (("a", 40.), ("b", -40.), ("c", 0.))]
    dispatch = TrDispatch(world)
    for board in made:
        board.join(dispatch)
    start = world.monotonic() + 0.1
    for i, board in enumerate(made):
        board.arm(start, 0.025, i / 3.)
    dispatch.start(2)
    advance(world, made, start + 1.)
    assert all(board.states for board in made)
    assert not any(board.find_trigger() for board in made)
    return world, dispatch, made


def advance(world, boards, limit):
    while world.monotonic() < limit:
        world.advance(limit)
        for board in boards:
            board.collect()


def test_firmware_is_kept_alive_and_triggers_together(boards):
    world, dispatch, made = boards
    now = world.monotonic()
    made[0].send("trsync_trigger oid=0 reason=1")
    advance(world, made, now + 0.1)
    triggers = [board.find_trigger() for board in made]
    assert [reason for _, reason in triggers] == [1, 2, 2]
    assert all(now < time < now + 0.005 for time, _ in triggers)
    dispatch.stop()


def test_lost_mcu_stops_all_within_the_timeout(boards):
    world, dispatch, made = boards
    now = world.monotonic()
    made[1].mcu.link.cut()
    advance(world, made, now + 0.5)
    for board in (made[0], made[2]):
        time, reason = board.find_trigger()
        assert reason in (2, 4) and now < time < now + 0.025 + 0.002
    dispatch.stop()
