# SPDX-License-Identifier: GPL-3.0-or-later
"""CAN by PIO and the second core: an RP2040 on a bus that is modelled bit by bit.

The other nodes resynchronise and read frames in their own way (unicorn_canwire.c).
As a bridge the chip passes on all frames, which tests what it receives and sends.
"""

import random

import firmware_matrix
import pytest
import unicorn_board
from can_bus import ADMIN, BridgeBoard
from can_wire import EXTENDED, REMOTE, WireBoard, WireBridge, WireBus
from step_runs import expect_clocks, start_steps
from test_unicorn_can import expect_uuid
from test_unicorn_usb import SMALL

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

CRYSTAL = 12000000
UUIDS = {"rp2040": expect_uuid(bytes.fromhex("E66138010203042F")),
         "rp2350": None}
# Ids that a bridge takes as meant for its own node, which has no number
NOT_SENT = (ADMIN, 0)
# Cycles of a bit at 1 Mbit/s; a word must come before the next sample
BIT_CYCLES = {"rp2040": 125, "rp2350": 150}


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def start(adapter, monkeypatch):
    """start(chip, options, kind): a chip that nobody has spoken to."""
    def make(config="can_rp2040", options=(), kind=WireBoard, folder=None):
        out = firmware_matrix.build(config, options, folder)
        unicorn_board.choose_chip(monkeypatch, out, config[-6:], CRYSTAL)
        board = kind(adapter)
        board.run_for(0.01 if kind is WireBoard else 0.1)
        return board
    return make


@pytest.fixture
def bridge(start):
    return WireBridge(start("bridge_rp2040", kind=BridgeBoard))


def give_number(board, bus, node=4):
    uuid, = bus.query()
    bus.set_node(board, uuid, node)
    assert bus.query() == []
    board.identify()
    return uuid


def some_frames(count, seed=1):
    """Frames of all kinds and lengths; stuffing at its worst among them."""
    rng = random.Random(seed)
    patterns = [b"\0" * 8, b"\xff" * 8, b"\x0f\x83" * 4, b"\x3c" * 8, b"\xe1" * 8]
    frames = []
    for i in range(count):
        data = (patterns[i // 9 % 5] if i % 2 else rng.randbytes(8))[:i % 9]
        frame_id = rng.choice([0, 0x7FF, 0x3F0, 0x3E0, rng.randrange(2048)])
        if i % 3 == 1:
            frame_id = EXTENDED | rng.choice(
                [0, 2**29 - 1, 0x1F07C1F0, rng.randrange(2**29)])
        if i % 7 == 6:
            frame_id, data = frame_id | REMOTE, b""
        frames.append((frame_id, data))
    return frames


def without_ours(seen):
    """Without what the bridge's own node answers to requests."""
    return [f for f in seen if f[0] != ADMIN + 1]


@pytest.mark.parametrize("chip", ["rp2040", "rp2350"])
def test_gets_a_number_and_answers(chip, start):
    board = start("can_" + chip)
    bus = WireBus(board)
    uuid = give_number(board, bus)
    assert UUIDS[chip] in (None, uuid)
    constants = board.dictionary["config"]
    assert constants["MCU"] == chip and constants["CANBUS_FREQUENCY"] == 1000000
    assert constants["RESERVE_PINS_CAN"] == "gpio4,gpio5"
    answer = board.query("get_canbus_id", "canbus_id")
    assert answer["canbus_uuid"] == uuid and answer["canbus_nodeid"] == 4
    for size in (0, 1, 3, 11, 47):
        data = bytes(range(size))
        assert board.query("debug_ping", "pong", data=data)["data"] == data
    status = board.query("get_canbus_status", "canbus_status")
    assert status["canbus_bus_state"] == 0
    assert status["rx_error"] == status["tx_error"] == 0
    assert bus.read_stats().errors == 0
    core = bus.read_core()
    assert core.overruns == core.waits == 0
    assert core.most_cycles < BIT_CYCLES[chip]


@pytest.mark.slow
@pytest.mark.parametrize("rate", [125000, 250000, 500000])
def test_other_speeds(rate, start, tmp_path):
    board = start(options=("CANBUS_FREQUENCY=%d" % rate, "RPXXXX_CANBUS_GPIO_RX=27",
                           "RPXXXX_CANBUS_GPIO_TX=0", *SMALL), folder=tmp_path)
    bus = WireBus(board, rate, pins=(27, 0))
    give_number(board, bus)
    assert board.dictionary["config"]["RESERVE_PINS_CAN"] == "gpio27,gpio0"
    assert bus.read_stats().errors == 0


def test_bridge_receives_all_frames(bridge):
    """Of all kinds, back to back: none is missing, changed, or twice."""
    frames = some_frames(180)
    for i in range(0, len(frames), 30):
        for frame_id, data in frames[i:i + 30]:
            bridge.send_from(0, frame_id, data)
        bridge.run_for(0.008)
    assert without_ours(bridge.seen) == frames
    stats = bridge.read_stats()
    assert stats.errors == 0 and stats.sent == len(frames)
    assert bridge.read_core().overruns == 0


def test_bridge_sends_all_frames(bridge):
    frames = [f for f in some_frames(110, seed=2) if f[0] not in NOT_SENT]
    seen = []
    for i in range(0, len(frames), 10):
        for frame_id, data in frames[i:i + 10]:
            bridge.send(frame_id, data)
        bridge.run_for(0.004)
        seen += bridge.receive()
    assert seen == frames
    assert bridge.read_stats().errors == 0
    assert bridge.boards[0].echoes == list(range(len(frames)))


def test_simultaneous_frames(bridge):
    """Two nodes and the bridge begin at once: the lowest id goes first."""
    other = bridge.add(ppm=150)
    bridge.run_for(0.0001)
    sent = {n: [(0x100 + (37 * i + 5 * n) % 64 * 8 + n, bytes([n, i]))
                for i in range(20)] for n in range(3)}
    for node in (0, other):
        for frame_id, data in sent[node]:
            bridge.send_from(node, frame_id, data)
    for frame_id, data in sent[2]:
        bridge.send(frame_id, data)
    bridge.run_for(0.02)
    stats = [bridge.read_stats(n) for n in (0, other)]
    assert [s.errors for s in stats] == [0, 0]
    assert min(s.lost for s in stats) > 3
    seen = bridge.receive(other)
    for n in (0, 2):
        assert [f for f in seen if f[0] % 8 == n] == sent[n]
    for n in (0, other):
        assert [f for f in without_ours(bridge.seen) if f[0] % 8 == n] == sent[n]


@pytest.mark.parametrize("ppm, jitter, delay", [
    (5000, 0, 14), (-5000, 0, 14), (10000, 6, 2), (-10000, 6, 2), (0, 12, 20)])
def test_clocks_that_differ(ppm, jitter, delay, start):
    """Half a per cent on long wires; jitter of 100 ns.  A per cent is beyond the
    standard: frames may have to be sent again, but all arrive.
    """
    bridge = WireBridge(start("bridge_rp2040", kind=BridgeBoard), ppm=ppm,
                        jitter=jitter, delay=delay)
    frames = [f for f in some_frames(64, seed=3) if f[0] not in NOT_SENT]
    for i in range(0, len(frames), 9):
        for frame_id, data in frames[i:i + 9]:
            bridge.send_from(0, frame_id, data)
        bridge.run_for(0.003)
        for frame_id, data in frames[i:i + 9]:
            bridge.send(frame_id, data)
        bridge.run_for(0.003)
    assert without_ours(bridge.seen) == frames
    assert bridge.receive() == frames
    assert bridge.read_stats().errors <= (0 if abs(ppm) <= 5000 else 6)


@pytest.mark.parametrize("frame_id, data", [
    (0x2A5, b"\x00\xff\x0f"), (EXTENDED | 0x1F00AA07, b"\x55"), (0x000, b"")])
def test_wrong_frames_are_not_delivered(frame_id, data, bridge):
    """Each bit is wrong once: somebody says so, and the next frame arrives."""
    n_bits = 1
    while n_bits < 160:
        before = bridge.read_stats()
        bridge.send_from(0, frame_id, data, flip=n_bits)
        bridge.send_from(0, 0x123, bytes([n_bits]))
        bridge.run_for(0.0006)
        after = bridge.read_stats()
        assert after.waiting == 0, n_bits
        if after.dropped == before.dropped:
            break               # the frame has no such bit
        n_bits += 1
    assert n_bits > 34
    seen = without_ours(bridge.seen)
    assert seen == [(0x123, bytes([i])) for i in range(1, n_bits)] + [
        (frame_id, data), (0x123, bytes([n_bits]))]


def test_bus_that_nobody_uses(start):
    """Alone and with nothing to say: not one dominant bit."""
    bus = WireBus(start())
    bus.run_for(0.05)
    assert bus.read_stats().dominant == 0


def test_nobody_acknowledges(start):
    """Passive, but on the bus; when somebody comes, all is sent."""
    board = start("bridge_rp2040", kind=BridgeBoard)
    bridge = WireBridge(board)
    bridge.set_node(board, UUIDS["rp2040"], 4)
    board.identify()
    states = board.dictionary["enumerations"]["canbus_bus_state"]
    bridge.library.unicorn_wire_begin(4, 5, 14)
    mute = bridge.add(is_mute=True)
    for i in range(3):
        bridge.send(0x200 + i, b"nobody")
    bridge.run_for(0.1)
    status = board.query("get_canbus_status", "canbus_status")
    assert status["canbus_bus_state"] == states["passive"]
    assert status["tx_retries"] > 50 and bridge.read_stats(mute).sent == 0
    host = bridge.add()
    bridge.run_for(0.05)
    assert bridge.receive(host) == [(0x200 + i, b"nobody") for i in range(3)]
    for i in range(150):
        bridge.send(0x210, bytes([i]))
        bridge.run_for(0.0005)
    assert len(bridge.receive(host)) > 60
    assert board.query("get_canbus_status",
                       "canbus_status")["canbus_bus_state"] == 0


def test_short_of_the_bus(start):
    """It leaves the bus, and joins it again after 128 times 11 idle bits."""
    board = start("bridge_rp2040", kind=BridgeBoard)
    bridge = WireBridge(board)
    bridge.set_node(board, UUIDS["rp2040"], 4)
    board.identify()
    states = board.dictionary["enumerations"]["canbus_bus_state"]
    bridge.break_wire(is_shorted=True)
    bridge.send(0x321, b"short")
    bridge.run_for(0.05)
    status = board.query("get_canbus_status", "canbus_status")
    assert status["canbus_bus_state"] in (states["off"], states["passive"])
    bridge.break_wire()
    bridge.run_for(0.05)
    bridge.send(0x322, b"again")
    bridge.run_for(0.05)
    assert (0x322, b"again") in bridge.receive()
    status = board.query("get_canbus_status", "canbus_status")
    assert status["canbus_bus_state"] != states["off"]


def test_transceiver_that_hears_nothing(start):
    """What is sent never comes back: bus off; and back when it does."""
    board = start("bridge_rp2040", kind=BridgeBoard)
    bridge = WireBridge(board)
    bridge.set_node(board, UUIDS["rp2040"], 4)
    board.identify()
    states = board.dictionary["enumerations"]["canbus_bus_state"]
    bridge.break_wire(is_open=True)
    bridge.send(0x321, b"open")
    bridge.run_for(0.0007)
    seen = set()
    for _ in range(20):
        seen.add(board.query("get_canbus_status",
                             "canbus_status")["canbus_bus_state"])
    assert states["off"] in seen
    bridge.break_wire()
    bridge.run_for(0.01)
    assert (0x321, b"open") in bridge.receive()


def test_adapter_and_its_node(bridge):
    board, = bridge.boards
    assert bridge.query() == [UUIDS["rp2040"]]
    bridge.set_node(board, UUIDS["rp2040"], 4)
    assert bridge.query() == []
    board.identify()
    constants = board.dictionary["config"]
    assert constants["CANBUS_BRIDGE"] == 1
    assert constants["RESERVE_PINS_CAN"] == "gpio4,gpio5"
    for size in (0, 7, 40):
        data = bytes(range(size))
        assert board.query("debug_ping", "pong", data=data)["data"] == data
    assert board.echoes == list(range(bridge.n_sent))


def test_request_of_the_boot_loader(start):
    board = start()
    bus = WireBus(board)
    bus.send(ADMIN, b"\x02" + bytes(6))
    bus.run_for(0.005)
    assert not board.resets
    bus.send(ADMIN, b"\x02" + UUIDS["rp2040"])
    board.run_for(0.005)
    assert board.resets and board.library.unicorn_wants_bootloader()


def test_number_given_to_another_node(start):
    board = start()
    bus = WireBus(board)
    give_number(board, bus)
    bus.send(ADMIN, b"\x01" + bytes(6) + b"\x04")
    bus.run_for(0.01)
    bus.set_node(board, UUIDS["rp2040"], 5)
    assert board.query("get_config", "config")["is_shutdown"] == 1


def run_steps(board, bus, traffic):
    """Ticks that steps each 40 us are late at most, while there is traffic."""
    interval, count = board.freq // 25000, 500
    origin = start_steps(board, interval, count)
    while board.clock < origin + interval * count:
        traffic()
    bus.run_for(0.01)
    edges = [c for c, _ in board.list_edges(board.find_pin("gpio11"), origin)]
    clocks = expect_clocks(origin, interval, count)
    assert len(edges) == count
    return [edge - clock for edge, clock in zip(edges, clocks, strict=True)]


def test_steps_beside_traffic(start):
    """Frames of others cost the first core nothing, ours an interrupt each."""
    board = start()
    bus = WireBus(board)
    give_number(board, bus)
    pin = board.find_pin
    board.configure(("config_stepper", dict(
        oid=0, step_pin=pin("gpio11"), dir_pin=pin("gpio10"), invert_step=-1,
        step_pulse_ticks=0)))
    limit = board.dictionary["config"]["STEP_LATENCY_TICKS"]

    def flood():
        for i in range(40):
            bus.send(0x555 + i, bytes(range(8)))
        bus.run_for(0.006)

    def ping():
        board.send("debug_ping", data=bytes(range(40)))

    begin = bus.read_stats()
    late = run_steps(board, bus, flood)
    assert -8 <= min(late) and max(late) <= 8
    assert bus.read_stats().sent - begin.sent > 100
    board.read_delays()
    late = run_steps(board, bus, ping)
    assert -8 <= min(late) and max(late) <= limit
    assert len(board.list_messages("pong")) > 2
    off, irq, *_ = board.read_delays()
    assert off < 250 and irq < 500


def count_frames(bus, frames, send):
    """Frames a second that go through, of 8 bytes each."""
    board, = bus.boards
    for frame_id, data in frames:
        send(frame_id, data)
    begin, seen = board.clock, 0
    while seen < len(frames) and board.clock - begin < board.freq:
        board.run_for(0.0001)
        seen += len(bus.receive()) if send == bus.send else 0
        if send != bus.send and not bus.read_stats().waiting:
            break
    return len(frames) * board.freq / (board.clock - begin)


def test_frames_a_second(bridge):
    """Of 111 bits and the stuffed ones a bus of 1 Mbit/s has room for 8500."""
    frames = [(0x2AA, bytes([i ^ 0x5A] * 8)) for i in range(50)]

    def send(frame_id, data):
        bridge.send_from(0, frame_id, data)

    assert count_frames(bridge, frames, send) > 7500
    assert count_frames(bridge, frames, bridge.send) > 6500
