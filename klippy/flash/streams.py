# SPDX-License-Identifier: GPL-3.0-or-later
"""Streams to a boot loader: a serial port, or a node on a CAN bus."""

import socket
import struct

import serial

from klippy.errors import PrinterError

# Messages to all nodes, and the id of the boot loader's node that we choose
ADMIN_ID = 0x3F0
ADMIN_QUERY, ADMIN_BOOT_LOADER, ADMIN_SET_NODE = 0x00, 0x02, 0x11
BOOT_NODE = 128
NODE_BASE = 0x100
ENTER_WAIT = 0.5
FRAME = struct.Struct("=IB3x8s")


class SerialStream:
    """A boot loader on a serial port (path)."""

    def __init__(self, path, baud=250000):
        try:
            self.port = serial.Serial(path, baud, timeout=0, exclusive=True)
        except (OSError, serial.SerialException) as err:
            raise PrinterError("Cannot open '%s': %s" % (path, err)) from None

    def send(self, data):
        """Send bytes."""
        self.port.write(data)
        self.port.flush()

    def receive(self, timeout):
        """Bytes that come within `timeout` seconds."""
        self.port.timeout = timeout
        first = self.port.read(1)
        self.port.timeout = 0
        return first + self.port.read(4096)

    def close(self):
        """Close the port."""
        self.port.close()


class CanStream:
    """A boot loader on a CAN bus: interface (can0), uuid (12 hex digits).

    bus: a connected raw CAN socket (or one that behaves so), default a new one.
    """

    def __init__(self, interface, uuid, bus=None):
        try:
            self.uuid = bytes.fromhex(uuid)
        except ValueError:
            self.uuid = b""
        if len(self.uuid) != 6:
            raise PrinterError("'%s' is not a CAN uuid: that is 12 hex digits, as in"
                               " 'canbus_uuid' of the printer.cfg" % (uuid,))
        self.bus = bus or self._open(interface)
        self.tx_id = NODE_BASE + 2 * BOOT_NODE
        self._enter()

    @staticmethod
    def _open(interface):
        bus = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        try:
            bus.bind((interface,))
        except OSError as err:
            bus.close()
            raise PrinterError("Cannot use the CAN interface '%s': %s"
                               % (interface, err.strerror)) from None
        return bus

    def _enter(self):
        """Let the board's firmware start its boot loader, and give that a node
        number; each is passed over by whoever is not meant."""
        self._send_frame(ADMIN_ID, bytes([ADMIN_BOOT_LOADER]) + self.uuid)
        self.receive(ENTER_WAIT)
        self._send_frame(ADMIN_ID, bytes([ADMIN_QUERY]))
        self.receive(ENTER_WAIT)
        self._send_frame(ADMIN_ID, bytes([ADMIN_SET_NODE]) + self.uuid
                         + bytes([BOOT_NODE]))

    def _send_frame(self, can_id, data):
        self.bus.send(FRAME.pack(can_id, len(data), data))

    def send(self, data):
        """Send bytes, eight a frame."""
        for i in range(0, len(data), 8):
            self._send_frame(self.tx_id, data[i:i + 8])

    def receive(self, timeout):
        """Bytes of the node's next frame within `timeout` seconds."""
        self.bus.settimeout(timeout)
        try:
            while True:
                can_id, size, data = FRAME.unpack(self.bus.recv(FRAME.size))
                if can_id == self.tx_id + 1:
                    return data[:size]
        except TimeoutError:
            return b""

    def close(self):
        """Leave the bus."""
        self.bus.close()
