# SPDX-License-Identifier: GPL-3.0-or-later
"""LPC176x and SAM firmware on a CAN bus: as test_unicorn_can.py, other controllers.

The models fault at pins without their function, memory that the processor caches,
tables out of order, a controller that is changed while it runs.
"""

import dataclasses

import firmware_matrix
import pytest
import unicorn_board
from can_bus import ADMIN, BridgeBoard, BridgedBus, CanBoard, CanBus
from simboard import frame
from step_runs import assert_prompt, expect_clocks, start_steps
from test_unicorn_can import (  # noqa: F401
    adapter,
    assert_leaves_and_joins,
    expect_uuid,
)
from test_unicorn_usb import SMALL, some

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]


@dataclasses.dataclass(frozen=True)
class Chip:
    """How a chip is started, its unique id, and pins for a test's stepper."""

    name: str
    crystal: int
    unique_id: str
    step: str
    dir: str
    out: str

    @property
    def uuid(self):
        return expect_uuid(bytes.fromhex(self.unique_id))


PROMPT = 400        # cycles that a frame's interrupt may delay a step
LPC_ID = "030405060708090A0B0C0D0E0F101112"
SAM_ID = b"SAM4 emulated id".hex()
SAMD_ID = "4433221188776655CCBBAA9901FFEEDD"
CHIPS = {c.name: c for c in (
    Chip("lpc1768", 12000000, LPC_ID, "P2.6", "P0.5", "P1.29"),
    Chip("lpc1769", 12000000, LPC_ID, "P2.6", "P0.5", "P1.29"),
    Chip("same70q20b", 12000000, SAM_ID, "PA7", "PA24", "PA15"),
    Chip("samc21g18", 12000000, SAMD_ID, "PA16", "PA17", "PA18"),
    Chip("same51j19", 32768, SAMD_ID, "PA16", "PA17", "PA18"))}
# Configuration, its pins
NODES = some([("can_lpc1768", "P0.0,P0.1"), ("can_same70q20b", "PC12,PD12"),
              ("can_samc21g18", "PA23,PA22")], [("can_same51j19", "PA25,PA24")])
# Chip, one more option, its pins
OTHERS = some([], [
    ("lpc1768", "LPC_MMENU_CANBUS_P0_21_P0_22", "P0.21,P0.22"),
    ("lpc1769", "LPC_MMENU_CANBUS_P0_4_P0_5", "P0.4,P0.5"),
    ("lpc1769", "LPC_MMENU_CANBUS_P2_7_P2_8", "P2.7,P2.8"),
    ("same70q20b", "ATSAM_MMENU_CANBUS_PB3_PB2", "PB3,PB2"),
    ("samc21g18", "ATSAMD_MMENU_CANBUS_PA25_PA24", "PA25,PA24"),
    ("samc21g18", "ATSAMD_MMENU_CANBUS_PB11_PB10", "PB11,PB10"),
    ("samc21g18", "ATSAMD_MMENU_CANBUS_PB15_PB14", "PB15,PB14"),
    ("same51j19", "ATSAMD_MMENU_CANBUS_PA23_PA22", "PA23,PA22"),
    ("same51j19", "ATSAMD_MMENU_CANBUS_PB13_PB12", "PB13,PB12"),
    ("same51j19", "ATSAMD_MMENU_CANBUS_PB15_PB14", "PB15,PB14")])
BRIDGES = some([("bridge_same51j19", "PA23,PA22")],
               [("bridge_lpc1769", "P0.0,P0.1"),
                ("bridge_same70q20b", "PC12,PD12")])
# What configurations have that are not in test/configs
OPTIONS = {"can_same51j19": "ATSAMD_MMENU_CANBUS_PA25_PA24=y",
           "bridge_lpc1769": "LPC_USBCANBUS=y",
           "bridge_same70q20b": "ATSAM_USBCANBUS=y"}


def find_chip(config):
    return CHIPS[config.split("_")[-1]]


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """build(config): folder of its firmware."""
    def make(config):
        if config in firmware_matrix.CONFIGS:
            return firmware_matrix.build(config)
        return firmware_matrix.build(
            find_chip(config).name, ("LOW_LEVEL_OPTIONS=y", OPTIONS[config], *SMALL),
            tmp_path_factory.getbasetemp() / config)
    return make


@pytest.fixture
def make_board(adapter, build, monkeypatch):  # noqa: F811
    """make_board(config, out, kind): a chip that nobody has spoken to."""
    def make(config, out=None, kind=CanBoard):
        chip = find_chip(config)
        unicorn_board.choose_chip(monkeypatch, out or build(config),
                                  chip.name, chip.crystal)
        board = kind(adapter)
        board.run_for(0.1 if kind is BridgeBoard else 0.02)
        return board
    return make


def join(board, bus, config, node=4):
    """The board gets its number; the host knows its dictionary."""
    bus.set_node(board, find_chip(config).uuid, node)
    board.identify()


@pytest.mark.parametrize("config, pins", NODES)
def test_gets_a_number_and_answers(config, pins, make_board):
    board = make_board(config)
    bus = CanBus([board])
    assert bus.query() == [find_chip(config).uuid]
    join(board, bus, config)
    assert bus.query() == []
    constants = board.dictionary["config"]
    assert constants["MCU"].startswith(config.split("_")[1])
    assert constants["CANBUS_FREQUENCY"] == 1000000
    assert constants["RESERVE_PINS_CAN"] == pins
    answer = board.query("get_canbus_id", "canbus_id")
    assert answer["canbus_uuid"] == find_chip(config).uuid
    for size in (0, 1, 3, 11, 47):
        data = bytes(range(size))
        assert board.query("debug_ping", "pong", data=data)["data"] == data
    status = board.query("get_canbus_status", "canbus_status")
    states = board.dictionary["enumerations"]["canbus_bus_state"]
    assert status["canbus_bus_state"] == states["active"]
    assert status["rx_error"] == status["tx_error"] == 0


@pytest.mark.parametrize("config, pins", NODES)
def test_steps_and_shutdown(config, pins, make_board):
    """Configured, it steps when it is told; stopped, pins go to their defaults."""
    chip = find_chip(config)
    board = make_board(config)
    bus = CanBus([board])
    join(board, bus, config)
    board.configure(
        ("config_stepper", dict(oid=0, step_pin=board.find_pin(chip.step),
                                dir_pin=board.find_pin(chip.dir),
                                invert_step=0, step_pulse_ticks=0)),
        ("config_digital_out", dict(oid=1, pin=board.find_pin(chip.out), value=0,
                                    default_value=1, max_duration=0)))
    interval = board.freq // 5000
    origin = start_steps(board, interval, 50, add=-3)
    bus.run_for(0.1)
    edges = [c for c, level in board.list_edges(board.find_pin(chip.step), origin)
             if level]
    assert_prompt(edges, expect_clocks(origin, interval, 50, -3), PROMPT)
    assert board.list_edges(board.find_pin(chip.out))[-1][1] == 0
    board.send("emergency_stop")
    assert board.list_edges(board.find_pin(chip.out))[-1][1] == 1
    assert board.query("get_config", "config")["is_shutdown"] == 1


@pytest.mark.parametrize("config, pins", NODES)
def test_only_what_is_for_us(config, pins, make_board):
    board = make_board(config)
    bus = CanBus([board])
    join(board, bus, config, 9)
    begin = len(bus.seen)
    for frame_id in (256 + 2 * 8, 256 + 2 * 10, 0x100, 0x7FF, 0x3F1):
        bus.send(frame_id, b"\x05\x10\x81\x2d\x7e")
    bus.send(ADMIN, b"\x01" + bytes(6) + b"\x0a")
    bus.run_for(0.01)
    assert bus.seen[begin:] == []
    assert board.query("get_config", "config")["is_shutdown"] == 0
    # a number that another gets as well
    bus.send(ADMIN, b"\x01" + bytes(6) + b"\x09")
    bus.run_for(0.01)
    bus.set_node(board, find_chip(config).uuid, 5)
    assert board.query("get_config", "config")["is_shutdown"] == 1


@pytest.mark.parametrize("config, pins", NODES)
def test_a_bus_without_anybody_and_a_short(config, pins, make_board):
    """Errors are counted; a short has the bus left, and it is joined again."""
    board = make_board(config)
    bus = CanBus([board])
    join(board, bus, config)
    assert_leaves_and_joins(board, bus)


@pytest.mark.parametrize("config, pins", NODES)
def test_long_answers_keep_their_order(config, pins, make_board):
    """Hundreds of frames, more than there are buffers: not one changes places."""
    board = make_board(config)
    bus = CanBus([board])
    join(board, bus, config)
    begin = len(board.messages)
    texts = [bytes([i]) * 40 for i in range(60)]
    for text in texts:
        board.send("debug_ping", data=text)
    bus.run_for(0.02)
    assert [m["data"] for m in board.list_messages("pong", begin)] == texts


def test_two_nodes_win_and_lose(make_board):
    """Boards of two families speak at once: no byte is lost."""
    configs = ["can_lpc1768", "can_same70q20b"]
    boards = [make_board(config) for config in configs]
    bus = CanBus(boards)
    for node, (board, config) in enumerate(zip(boards, configs, strict=True), 4):
        bus.boards = [board]
        join(board, bus, config, node)
    bus.boards = boards
    for board in boards:
        ping = board.commands["debug_ping"].encode({"data": b"x" * 40})
        block = frame(board.seq, ping)
        board.seq += 1
        for i in range(0, len(block), 8):
            bus.send(256 + 2 * board.node, block[i:i + 8])
    begin = [len(b.messages) for b in boards]
    bus.run_for(0.03)
    for board, n in zip(boards, begin, strict=True):
        assert [m["data"] for m in board.list_messages("pong", n)] == [b"x" * 40]
    assert bus.n_lost > 0


@pytest.mark.parametrize("chip, option, pins", OTHERS)
def test_other_pins_and_speed(chip, option, pins, make_board, tmp_path):
    options = ("LOW_LEVEL_OPTIONS=y", option + "=y", "CANBUS_FREQUENCY=500000",
               *SMALL)
    board = make_board(chip, firmware_matrix.build(chip, options, tmp_path))
    bus = CanBus([board], 500000)
    join(board, bus, chip, 100)
    assert board.dictionary["config"]["RESERVE_PINS_CAN"] == pins
    assert board.query("get_canbus_id", "canbus_id")["canbus_nodeid"] == 100


@pytest.mark.parametrize("config, pins", BRIDGES)
def test_adapter_and_two_nodes(config, pins, make_board):
    bridge = make_board(config, None, BridgeBoard)
    other = "can_samc21g18" if "lpc" in config else "can_lpc1768"
    head = make_board(other)
    bus = BridgedBus([bridge, head])
    uuids = [find_chip(config).uuid, find_chip(other).uuid]
    assert sorted(bus.query()) == sorted(uuids)
    join(bridge, bus, config)
    bus.set_node(head, uuids[1], 5)
    head.identify()
    assert bus.query() == []
    constants = bridge.dictionary["config"]
    assert constants["CANBUS_BRIDGE"] == 1
    assert constants["RESERVE_PINS_CAN"] == pins
    for board in (bridge, head, bridge):
        for size in (0, 7, 40):
            data = bytes(range(size))
            assert board.query("debug_ping", "pong", data=data)["data"] == data
    assert bridge.echoes == list(range(bus.n_sent))
    status = bridge.query("get_canbus_status", "canbus_status")
    assert status["canbus_bus_state"] == 0

