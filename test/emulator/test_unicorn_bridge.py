# SPDX-License-Identifier: GPL-3.0-or-later
"""A chip that is a CAN adapter on USB, and a node: with another board on its bus.

The host's side of USB asks what Linux's driver gs_usb asks, and faults when the
answers have another size.
"""

import firmware_matrix
import pytest
import unicorn_board
from can_bus import BridgeBoard, BridgedBus, CanBoard
from test_unicorn_can import (  # noqa: F401
    CAN,
    CHIP_ID,
    UUID,
    adapter,
    build,
    expect_uuid,
)
from test_unicorn_usb import SMALL, some

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

HEAD_UUID = expect_uuid(CHIP_ID[:11] + b"\x02")
BRIDGES = some([("stm32f446", "PB12_PB13"), ("stm32g0b1", "PB0_PB1")],
               [("stm32f072", "PB8_PB9"), ("stm32h743", "PB8_PB9")])


def list_options(chip, pins):
    """None for a configuration of test/configs."""
    if "bridge_" + chip in firmware_matrix.CONFIGS:
        return None
    return ("STM32_USBCANBUS_PA11_PA12=y", "STM32_CMENU_CANBUS_%s=y" % (pins,),
            *SMALL)


@pytest.fixture
def make_board(adapter, build, monkeypatch):  # noqa: F811
    """make_board(chip, options, kind, chip_id): a chip that nobody has spoken to."""
    def make(chip, options, kind=BridgeBoard, chip_id=1):
        monkeypatch.setenv("UNICORN_ID", str(chip_id))
        out = build(chip, options) if options else firmware_matrix.build(
            "bridge_" + chip)
        unicorn_board.choose_chip(monkeypatch, out, chip, 8000000)
        board = kind(adapter)
        board.run_for(0.1)
        return board
    return make


@pytest.mark.parametrize("chip, pins", BRIDGES)
def test_adapter_and_two_nodes(chip, pins, make_board):
    bridge = make_board(chip, list_options(chip, pins))
    head = make_board("stm32f103", CAN, CanBoard, chip_id=2)
    bus = BridgedBus([bridge, head])
    assert bus.query() == [UUID, HEAD_UUID]
    bus.set_node(bridge, UUID, 4)
    bus.set_node(head, HEAD_UUID, 5)
    assert bus.query() == []
    bridge.identify()
    constants = bridge.dictionary["config"]
    assert constants["CANBUS_BRIDGE"] == 1
    assert constants["RESERVE_PINS_USB"] == "PA11,PA12"
    assert constants["RESERVE_PINS_CAN"] == pins.replace("_", ",")
    head.identify()
    assert head.dictionary["config"]["MCU"] == "stm32f103xe"
    for board in (bridge, head, bridge):
        for size in (0, 7, 40):
            data = bytes(range(size))
            assert board.query("debug_ping", "pong", data=data)["data"] == data
    # each frame came back, in order
    assert bridge.echoes == list(range(bus.n_sent))
    status = bridge.query("get_canbus_status", "canbus_status")
    assert status["canbus_bus_state"] == 0


def test_node_is_reached_while_the_bus_is_dead(make_board):
    """Nobody acknowledges on the bus: the adapter's own node answers."""
    bridge = make_board("stm32f446", None)
    bus = BridgedBus([bridge])
    bus.set_node(bridge, UUID, 4)
    bridge.identify()
    for i in range(8):
        bus.send(0x200 + i, b"nobody")
    bus.run_for(0.2)
    assert bridge.query("get_config", "config")["is_config"] == 0
    assert bridge.query("get_canbus_status",
                        "canbus_status")["canbus_bus_state"] == 2


def test_reset_of_usb(make_board):
    """The computer starts anew: the node keeps what it was configured to."""
    bridge = make_board("stm32g0b1", None)
    bus = BridgedBus([bridge])
    bus.set_node(bridge, UUID, 4)
    bridge.identify()
    bridge.configure()
    bridge.library.unicorn_usb_replug()
    bus.run_for(0.05)
    bus.set_node(bridge, UUID, 6)
    assert bridge.query("get_config", "config")["is_config"] == 1
