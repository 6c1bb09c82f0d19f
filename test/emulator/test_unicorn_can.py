# SPDX-License-Identifier: GPL-3.0-or-later
"""STM32 firmware on a CAN bus: emulated chips, and a host of the tests' own."""

import firmware_matrix
import pytest
import unicorn_board
from can_bus import ADMIN, CanBoard, CanBus
from simboard import frame
from test_unicorn_usb import SMALL, some

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

CAN = ("STM32_CANBUS_PA11_PA12=y", *SMALL)
# Chip, and the pins of its configuration
CHIPS = some(
    [("stm32f103", "PB8,PB9"), ("stm32g0b1", "PB0,PB1"), ("stm32h743", "PA11,PA12")],
    [(chip, "PA11,PA12") for chip in ("stm32f042", "stm32f407", "stm32f446",
                                      "stm32g431", "stm32h723")])
CHIP_ID = bytes.fromhex("30FFDA054D38353029045701")
MASK = 2**64 - 1


def expect_uuid(chip_id):
    """The first six bytes of fasthash64, computed with whole numbers."""
    def mix(h):
        h = (h ^ h >> 23) * 0x2127599BF4325C37 & MASK
        return h ^ h >> 47
    factor = 0x880355F21E6D1965
    h = 0xA16231A7 ^ len(chip_id) * factor & MASK
    for i in range(0, len(chip_id), 8):
        word = int.from_bytes(chip_id[i:i + 8], "little")
        h = (h ^ mix(word)) * factor & MASK
    return mix(h).to_bytes(8, "little")[:6]


UUID = expect_uuid(CHIP_ID)


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """build(chip, options): folder of a firmware, once for all tests."""
    def make(chip, options=CAN):
        if options == CAN and "can_" + chip in firmware_matrix.CONFIGS:
            return firmware_matrix.build("can_" + chip)
        name = "%s-%x" % (chip, abs(hash(options)))
        return firmware_matrix.build(chip, options,
                                     tmp_path_factory.getbasetemp() / name)
    return make


@pytest.fixture
def make_board(adapter, build, monkeypatch):
    """make_board(chip, options, crystal): a chip that nobody has spoken to."""
    def make(chip, options=CAN, crystal=8000000):
        unicorn_board.choose_chip(monkeypatch, build(chip, options), chip, crystal)
        board = CanBoard(adapter)
        board.run_for(0.01)
        return board
    return make


@pytest.mark.parametrize("chip, pins", CHIPS)
def test_gets_a_number_and_answers(chip, pins, make_board):
    board = make_board(chip)
    bus = CanBus([board])
    assert bus.query() == [UUID]
    bus.set_node(board, UUID, 4)
    assert bus.query() == []
    board.identify()
    constants = board.dictionary["config"]
    assert constants["MCU"].startswith(chip)
    assert constants["CANBUS_FREQUENCY"] == 1000000
    assert constants["RESERVE_PINS_CAN"] == pins
    answer = board.query("get_canbus_id", "canbus_id")
    assert answer["canbus_uuid"] == UUID and answer["canbus_nodeid"] == 4
    for size in (0, 1, 3, 11, 47):
        data = bytes(range(size))
        assert board.query("debug_ping", "pong", data=data)["data"] == data
    status = board.query("get_canbus_status", "canbus_status")
    states = board.dictionary["enumerations"]["canbus_bus_state"]
    assert status["canbus_bus_state"] == states["active"]
    assert status["rx_error"] == status["tx_error"] == 0


def test_frames_of_others_are_not_for_us(make_board):
    board = make_board("stm32f103")
    bus = CanBus([board])
    bus.set_node(board, UUID, 9)
    board.identify()
    begin = len(bus.seen)
    for frame_id in (256 + 2 * 8, 256 + 2 * 10, 0x100, 0x7FF):
        bus.send(frame_id, b"\x05\x10\x81\x2d\x7e")
    bus.send(ADMIN, b"\x01" + bytes(6) + b"\x0a")
    bus.send(ADMIN, b"")
    bus.run_for(0.01)
    assert bus.seen[begin:] == []
    assert board.query("get_config", "config")["is_shutdown"] == 0


def test_number_given_to_another_node(make_board):
    """Two of one number would both obey: this one stops."""
    board = make_board("stm32f103")
    bus = CanBus([board])
    bus.set_node(board, UUID, 4)
    board.identify()
    bus.send(ADMIN, b"\x01" + bytes(6) + b"\x04")
    bus.run_for(0.01)
    bus.set_node(board, UUID, 5)
    assert board.query("get_config", "config")["is_shutdown"] == 1


@pytest.mark.parametrize("chips", [("stm32f103", "stm32g0b1")])
def test_two_nodes_at_once(chips, make_board):
    """Both send long answers: arbitration is lost and won, no byte is."""
    boards = [make_board(chip) for chip in chips]
    bus = CanBus(boards)
    # (the chips' ids are the same: each is alone when it gets its number)
    for node, board in enumerate(boards, 4):
        bus.boards = [board]
        bus.set_node(board, UUID, node)
        board.identify()
    bus.boards = boards
    for board in boards:
        begin = len(board.messages)
        data = b"0123456789" * 4
        for _ in range(6):
            board.send("debug_ping", data=data)
        assert [m["data"] for m in board.list_messages("pong", begin)] == [data] * 6
    ping = [b.commands["debug_ping"].encode({"data": b"x" * 40}) for b in boards]
    for board, payload in zip(boards, ping, strict=True):
        block = frame(board.seq, payload)
        board.seq += 1
        for i in range(0, len(block), 8):
            bus.send(256 + 2 * board.node, block[i:i + 8])
    begin = [len(b.messages) for b in boards]
    bus.run_for(0.03)
    for board, n in zip(boards, begin, strict=True):
        assert [m["data"] for m in board.list_messages("pong", n)] == [b"x" * 40]
    assert bus.n_lost > 0


@pytest.mark.parametrize("chip", ["stm32f103", "stm32g0b1"])
def test_a_bus_without_anybody_and_a_short(chip, make_board):
    """Errors are counted; a short has the bus left, and it is joined again."""
    board = make_board(chip)
    bus = CanBus([board])
    bus.set_node(board, UUID, 4)
    board.identify()
    assert_leaves_and_joins(board, bus)


def assert_leaves_and_joins(board, bus):
    """Alone it stays on the bus; a short has it leave, and then join again."""
    bus.has_host = False
    bus.send(256 + 2 * 4, board_block(board))
    for _ in range(60):
        bus.step()
    assert board.library.unicorn_can_bit_rate() == 1000000
    bus.is_shorted = True
    for _ in range(60):
        bus.step()
    assert not board.library.unicorn_can_bit_rate()
    bus.has_host, bus.is_shorted = True, False
    bus.run_for(0.02)
    assert board.library.unicorn_can_bit_rate() == 1000000
    status = board.query("get_canbus_status", "canbus_status")
    assert status["tx_error"] > 10 and status["tx_retries"] > 10
    assert status["canbus_bus_state"] == 0


def board_block(board):
    """A block that is answered by an ack."""
    board.seq += 1
    return frame(board.seq - 1, b"")


@pytest.mark.slow
@pytest.mark.parametrize("chip, options, pins", [
    ("stm32f103", ("STM32_MMENU_CANBUS_PB8_PB9=y",), "PB8,PB9"),
    ("stm32f407", ("STM32_MMENU_CANBUS_PB12_PB13=y",), "PB12,PB13"),
    ("stm32g0b1", ("STM32_MMENU_CANBUS_PB0_PB1=y",), "PB0,PB1"),
    ("stm32h743", ("STM32_MMENU_CANBUS_PB5_PB6=y",), "PB5,PB6"),
    ("stm32f072", ("STM32_MMENU_CANBUS_PD0_PD1=y",), "PD0,PD1")])
def test_other_pins_and_speed(chip, options, pins, make_board):
    board = make_board(chip, (*options, "CANBUS_FREQUENCY=500000", *SMALL))
    bus = CanBus([board], 500000)
    bus.set_node(board, UUID, 100)
    board.identify()
    assert board.dictionary["config"]["RESERVE_PINS_CAN"] == pins
    assert board.query("get_canbus_id", "canbus_id")["canbus_nodeid"] == 100


@pytest.mark.parametrize("chip, in_rom", [("stm32f103", False),
                                          ("stm32g0b1", True)])
def test_request_of_the_boot_loader(chip, in_rom, make_board):
    board = make_board(chip)
    bus = CanBus([board])
    bus.send(ADMIN, b"\x02" + bytes(6))
    bus.run_for(0.005)
    assert not board.resets
    bus.send(ADMIN, b"\x02" + UUID)
    bus.run_for(0.005)
    assert board.resets
    board.library.unicorn_restart(200000)
    assert board.library.unicorn_is_in_rom() == in_rom
