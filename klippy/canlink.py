# SPDX-License-Identifier: GPL-3.0-or-later
"""Links over a CAN bus: raw sockets, and the numbers that nodes get.

A node without a number is known by its uuid of six bytes.  A host gives it a
number n; data then has the id 256 + 2 n to the node, and one more from it.
"""

import select
import socket
import struct
import time

from klippy.seriallink import FileLink, error, explain

ADMIN, ADMIN_REPLY = 0x3F0, 0x3F1
QUERY_UNASSIGNED, SET_NODE_ID, NEED_NODE_ID = 0x00, 0x01, 0x20
DATA_BASE = 256
UUID_SIZE = 6
FIRST_NODE, LAST_NODE = 4, 127
# What nodes are that ask for a number, by the request that would give it
APPLICATIONS = {0x01: "Klipper", 0x11: "Katapult"}
FRAME = struct.Struct("=IB3x8s")
FILTER = struct.Struct("=II")
STANDARD_MASK = 0x7FF


def parse_uuid(text):
    """Six bytes of 12 hex digits.  Raises error for another text."""
    try:
        uuid = bytes.fromhex(text)
    except ValueError:
        uuid = b""
    if len(uuid) != UUID_SIZE:
        raise error("'%s' is not a canbus_uuid: that is 12 hex digits, as"
                    " `klippy canbus query can0` shows them" % (text,))
    return uuid


def open_bus(interface):
    """A raw socket of a CAN interface.  Raises error with what can be done."""
    bus = None
    try:
        bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        bus.bind((interface,))
    except OSError as err:
        if bus is not None:
            bus.close()
        raise error("Unable to use the CAN interface '%s': %s" % (
            interface, "there is no such interface; is it up, with its bitrate set?"
            if err.errno == 19 else explain(err))) from None
    bus.setblocking(False)
    return bus


def send_frame(bus, can_id, data):
    """Send one frame.  Raises error if the bus does not take it."""
    try:
        bus.send(FRAME.pack(can_id, len(data), data))
    except OSError as err:
        raise error("Unable to send on the CAN bus: %s" % (explain(err),)) from None


def receive_frame(bus):
    """(id, data) of a frame that has come, None without one."""
    try:
        can_id, size, data = FRAME.unpack(bus.recv(FRAME.size))
    except (BlockingIOError, struct.error):
        return None
    return can_id, data[:size]


def accept_only(bus, can_id):
    """Let the kernel drop frames of all other ids."""
    if bus.family == socket.AF_CAN:
        bus.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER,
                       FILTER.pack(can_id, STANDARD_MASK))


class CanLink(FileLink):
    """A node's data: `client_id` is the id of what goes to it."""

    kind = "can"

    def __init__(self, bus, node_id):
        super().__init__(bus.fileno(), bus)
        self.client_id = DATA_BASE + 2 * node_id


def open_node(interface, uuid, node_id):
    """Give a node its number; the link to it.  Raises error."""
    bus = open_bus(interface)
    accept_only(bus, DATA_BASE + 2 * node_id + 1)
    try:
        send_frame(bus, ADMIN, bytes([SET_NODE_ID]) + uuid + bytes([node_id]))
    except error:
        bus.close()
        raise
    return CanLink(bus, node_id)


def query_unassigned(bus, wait=2.):
    """{uuid: name of its program} of nodes without a number that answer within
    `wait` seconds."""
    found = {}
    send_frame(bus, ADMIN, bytes([QUERY_UNASSIGNED]))
    deadline = time.monotonic() + wait
    while True:
        left = deadline - time.monotonic()
        if left <= 0. or not select.select([bus], [], [], left)[0]:
            return found
        frame = receive_frame(bus)
        if frame is None or frame[0] != ADMIN_REPLY:
            continue
        data = frame[1]
        if len(data) > UUID_SIZE and data[0] == NEED_NODE_ID:
            program = data[7] if len(data) > 7 else SET_NODE_ID
            found[data[1:7]] = APPLICATIONS.get(program, "unknown (%d)" % (program,))
