# SPDX-License-Identifier: GPL-3.0-or-later
"""The host on a real CAN bus of the kernel (vcan): a board, a boot loader, noise."""

import os
import pathlib
import socket
import sys

import relay
from linux_machine import Machine
from test_blocks import IMAGE, CanBoard, FakeLoader, read_back
from test_blocks import UUID as BOOT_UUID

from klippy import canlink

BUS = "vcan0"
UUID = bytes.fromhex("0a1b2c3d4e5f")


class Node(relay.Relay):
    """A board of the bus: the firmware's bytes, eight a frame."""

    def __init__(self, console):
        self.bus = canlink.open_bus(BUS)
        self.node = None
        super().__init__(console, self.bus.fileno())

    def to_host(self, data):
        for i in range(0, len(data) if self.node else 0, 8):
            # noise: the same bytes to and from a neighbour
            for can_id in (257 + 2 * self.node + 2, 256 + 2 * self.node + 2):
                canlink.send_frame(self.bus, can_id, data[i:i + 8])
            canlink.send_frame(self.bus, 257 + 2 * self.node, data[i:i + 8])

    def from_host(self):
        can_id, data = canlink.receive_frame(self.bus)
        if can_id == canlink.ADMIN and data[0] == canlink.QUERY_UNASSIGNED:
            if self.node is None:
                canlink.send_frame(self.bus, canlink.ADMIN_REPLY,
                                   bytes([canlink.NEED_NODE_ID]) + UUID + b"\x01")
        elif can_id == canlink.ADMIN and data[:7] == b"\x01" + UUID:
            self.node = data[7]
        elif self.node is not None and can_id == 256 + 2 * self.node:
            return data
        return b""


class CanMachine(Machine):
    """Its firmware is a node."""

    def open_link(self):
        self.node = Node(self.run.link)
        self.node.start()
        listed = relay.run(sys.executable, "-m", "klippy", "canbus", "query", BUS)
        assert "canbus_uuid: %s    (Klipper)" % (UUID.hex(),) in listed, listed
        relay.ok("listed")
        return "canbus_uuid: %s\ncanbus_interface: %s" % (UUID.hex(), BUS)


def check_absent_bus():
    try:
        canlink.open_bus("can7")
    except canlink.error as err:
        assert "there is no such interface" in str(err), err
        relay.ok("absent")


def check_filter():
    """The kernel drops frames of other ids: what comes is all there is."""
    bus, other = canlink.open_bus(BUS), canlink.open_bus(BUS)
    canlink.accept_only(bus, 0x105)
    for can_id in (0x100, 0x104, 0x105, 0x106, 0x3F1):
        canlink.send_frame(other, can_id, b"12")
    assert canlink.receive_frame(bus) == (0x105, b"12")
    assert canlink.receive_frame(bus) is None
    bus.close()
    other.close()
    relay.ok("filtered")


def check_flash():
    """`klippy firmware flash` by the block protocol."""
    out = relay.FOLDER / "out"
    out.mkdir()
    (out / "klipper.bin").write_bytes(IMAGE)
    (out / "auto.conf").write_text(
        'CONFIG_MCU="stm32f103xe"\nCONFIG_BOARD_DIRECTORY="stm32"\n'
        "CONFIG_FLASH_APPLICATION_ADDRESS=0x8002000\n")
    bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    bus.bind((BUS,))
    loader = FakeLoader()
    CanBoard(bus, loader).start()
    relay.run(sys.executable, "-m", "klippy", "firmware", "flash", "--out", out,
              "--device", "%s:%s" % (BUS, BOOT_UUID.hex()))
    assert read_back(loader)[:len(IMAGE)] == IMAGE and loader.running
    relay.ok("flashed")


def main(program):
    relay.run("/bin/busybox", "ip", "link", "add", BUS, "type", "vcan")
    relay.run("/bin/busybox", "ip", "link", "set", BUS, "up")
    check_absent_bus()
    check_filter()
    check_flash()
    machine = CanMachine(pathlib.Path(program), relay.FOLDER, *relay.OPTIONS)
    relay.check_print(machine)
    counts = machine.node.count.values()
    assert min(counts) > 500, counts
    assert machine.stop() == 0
    relay.ok("stopped")
    sys.stdout.flush()
    os._exit(0)                         # the node is a thread that waits


main(*sys.argv[1:])
