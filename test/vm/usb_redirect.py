# SPDX-License-Identifier: GPL-3.0-or-later
"""An emulated chip is a USB device of the virtual machine.

The other end of QEMU's usb-redir: it hands over what drivers of the kernel ask, and
each request becomes packets on the chip's bus.  The chip runs as long as packets
take, and while there is nothing to do.  Source: usbredir's protocol, version 0.7;
USB 2.0, chapters 5 and 8.
"""

import select
import socket
import struct
import threading

from test_unicorn_usb import ACK, IN, NAK, NOTHING, OUT, SETUP, STALL, transact

HELLO, DEVICE_CONNECT, DEVICE_DISCONNECT, RESET = range(4)
INTERFACE_INFO, EP_INFO, SET_CONFIGURATION, GET_CONFIGURATION = 4, 5, 6, 7
CONFIGURATION_STATUS, SET_ALT, GET_ALT, ALT_STATUS = 8, 9, 10, 11
START_INTERRUPT, STOP_INTERRUPT, INTERRUPT_STATUS, CANCEL = 15, 16, 17, 21
CONTROL, BULK = 100, 101
OK, CANCELLED, STALLED = 0, 1, 4
CAP_DEVICE_VERSION, CAP_EP_SIZE = 1 << 1, 1 << 4
HEADER = struct.Struct("<III")
CONTROL_HEADER = struct.Struct("<BBBBHHH")
BULK_HEADER = struct.Struct("<BBHI")
FULL_SPEED, ADDRESS, NO_TYPE = 1, 5, 255
EP_SIZE = 64
SLOT = 40e-6                    # s, of a packet
N_TRIES = 20000
REST = .002                     # s that the chip runs between looks at the socket


class Left(Exception):
    """The device is no longer on the bus."""


class Redirect(threading.Thread):
    """Serves one virtual machine on a Unix socket, until close()."""

    def __init__(self, board, path, idle=None):
        super().__init__(daemon=True)
        self.board, self.idle = board, idle or (lambda: board.run_for(REST))
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(path))
        self.listener.listen()
        self.reads = []                 # (id, endpoint, length) of bulk transfers
        self.pids = {}                  # of endpoints
        self.is_closing = False
        self.failure = None

    def close(self):
        """End it; what the chip or the protocol did wrong is raised here."""
        self.is_closing = True
        self.join()
        if self.failure:
            raise self.failure

    def run(self):
        try:
            while not select.select([self.listener], [], [], .1)[0]:
                if self.is_closing:
                    return
            self.link, _ = self.listener.accept()
            with self.link:
                try:
                    self._serve()
                except Left:
                    self.send(DEVICE_DISCONNECT, 0, b"")
                    self._wait_for_end()
        except (EOFError, ConnectionError):
            pass                        # the machine is off
        except Exception as err:        # noqa: BLE001 - for close()
            self.failure = err
        finally:
            self.listener.close()

    def _serve(self):
        self.send(HELLO, 0, b"klippy test".ljust(64, b"\0") + struct.pack(
            "<I", CAP_DEVICE_VERSION | CAP_EP_SIZE))
        self.connect()
        while not self.is_closing:
            if self.board.resets:       # for its boot loader
                raise Left
            if select.select([self.link], [], [], 0)[0]:
                kind, size, number = HEADER.unpack(self.take(HEADER.size))
                self.handle(kind, number, self.take(size))
            else:
                self.poll_reads()

    def _wait_for_end(self):
        while not self.is_closing:
            if select.select([self.link], [], [], .1)[0]:
                self.take(1)

    def send(self, kind, number, data):
        self.link.sendall(HEADER.pack(kind, len(data), number) + data)

    def take(self, size):
        data = b""
        while len(data) < size:
            more = self.link.recv(size - len(data))
            if not more:
                raise EOFError
            data += more
        return data

    # ---- The device

    def connect(self):
        """Enumerate it as far as a hub would, and show it."""
        self.board.library.unicorn_usb_release()
        self.board.run_for(.01)
        device = self.control(0x80, 6, 0x100, 0, 18)[1]
        self.control(0, 5, ADDRESS, 0, 0)
        self.board.library.unicorn_usb_set_address(ADDRESS)
        self.config = self.control(0x80, 6, 0x200, 0, 255)[1]
        self.send_layout()
        self.send(DEVICE_CONNECT, 0, struct.pack(
            "<4BHHH", FULL_SPEED, *device[4:7], *struct.unpack("<HHH", device[8:14])))

    def send_layout(self):
        """Interfaces and endpoints."""
        interfaces, types = [], [NO_TYPE] * 32
        sizes, owners, intervals = [0] * 32, [0] * 32, [0] * 32
        types[0] = types[16] = 0
        sizes[0] = sizes[16] = EP_SIZE
        at = 0
        while at < len(self.config):
            part = self.config[at:at + self.config[at]]
            if part[1] == 4:
                interfaces.append((part[2], *part[5:8]))
            elif part[1] == 5:
                place = (part[2] & 0x80) >> 3 | part[2] & 15
                types[place], owners[place] = part[3] & 3, interfaces[-1][0]
                sizes[place], intervals[place] = part[4] | part[5] << 8, part[6]
            at += len(part)
        self.send(EP_INFO, 0, bytes(types) + bytes(intervals) + bytes(owners)
                  + struct.pack("<32H", *sizes))
        columns = [bytes(c).ljust(32, b"\0") for c in zip(*interfaces, strict=True)]
        self.send(INTERFACE_INFO, 0, struct.pack("<I", len(interfaces))
                  + b"".join(columns))

    def transact(self, token, endpoint, data=b"", pid=0):
        """(answer, data) of one packet, for which the chip runs a while."""
        answer, got = transact(self.board, token, endpoint, data, pid)
        if answer == NOTHING:
            raise Left
        assert answer in (ACK, NAK, STALL), answer
        self.board.run_for(SLOT)
        return answer, got

    def packet(self, token, endpoint, data=b"", pid=0):
        """A packet, again and again while the device has no time for it."""
        for _ in range(N_TRIES):
            answer, got = self.transact(token, endpoint, data, pid)
            if answer != NAK:
                return answer == ACK, got
        raise AssertionError("endpoint %d does not answer" % (endpoint,))

    def control(self, kind, request, value, index, length, data=b""):
        """(status, data) of a control transfer."""
        setup = struct.pack("<BBHHH", kind, request, value, index, length)
        assert self.packet(SETUP, 0, setup)[0]
        got, pid = b"", 1
        for i in range(0, len(data), EP_SIZE):
            if not self.packet(OUT, 0, data[i:i + EP_SIZE], pid)[0]:
                return STALLED, b""
            pid ^= 1
        while kind & 0x80 and len(got) < length:
            done, part = self.packet(IN, 0)
            if not done:
                return STALLED, b""
            got += part
            if len(part) < EP_SIZE:
                break
        ending = OUT if kind & 0x80 and length else IN
        return (OK if self.packet(ending, 0, b"", 1)[0] else STALLED), got

    # ---- What QEMU asks

    def handle(self, kind, number, data):
        if kind == CONTROL:
            self.handle_control(number, data)
        elif kind == BULK:
            self.handle_bulk(number, data)
        elif kind == SET_CONFIGURATION:
            self.pids = {}
            status, _ = self.control(0, 9, data[0], 0, 0)
            self.send(CONFIGURATION_STATUS, number, bytes([status, data[0]]))
        elif kind == GET_CONFIGURATION:
            status, got = self.control(0x80, 8, 0, 0, 1)
            self.send(CONFIGURATION_STATUS, number, bytes([status]) + got)
        elif kind in (SET_ALT, GET_ALT):
            alt = data[1] if kind == SET_ALT else 0
            self.send(ALT_STATUS, number, bytes([OK, data[0], alt]))
        elif kind in (START_INTERRUPT, STOP_INTERRUPT):
            self.send(INTERRUPT_STATUS, number, bytes([OK, data[0]]))
        elif kind == CANCEL:
            self.cancel(number)
        else:
            assert kind in (HELLO, RESET), kind

    def handle_control(self, number, data):
        _, request, kind, _, value, index, length = CONTROL_HEADER.unpack(
            data[:CONTROL_HEADER.size])
        status, got = self.control(kind, request, value, index, length,
                                   data[CONTROL_HEADER.size:])
        length = len(got) if kind & 0x80 else length
        self.send(CONTROL, number, CONTROL_HEADER.pack(
            data[0], request, kind, status, value, index, length) + got)

    def handle_bulk(self, number, data):
        endpoint, _, length, stream = BULK_HEADER.unpack(data[:BULK_HEADER.size])
        if endpoint & 0x80:
            self.reads.append((number, endpoint, length))
            return
        body = data[BULK_HEADER.size:]
        for i in range(0, len(body), EP_SIZE):
            pid = self.pids.get(endpoint, 0)
            assert self.packet(OUT, endpoint, body[i:i + EP_SIZE], pid)[0]
            self.pids[endpoint] = pid ^ 1
        self.send(BULK, number, BULK_HEADER.pack(endpoint, OK, length, stream))

    def poll_reads(self):
        """Try each endpoint that somebody reads; else let time pass."""
        moved = False
        for number, endpoint, _ in self.reads[:1]:
            answer, got = self.transact(IN, endpoint & 15)
            if answer == ACK:           # each packet is a transfer
                self.reads.pop(0)
                self.send(BULK, number, BULK_HEADER.pack(
                    endpoint, OK, len(got), 0) + got)
                moved = True
        if not moved:
            self.idle()

    def cancel(self, number):
        for read in self.reads:
            if read[0] == number:
                self.reads.remove(read)
                self.send(BULK, number, BULK_HEADER.pack(read[1], CANCELLED, 0, 0))
                return
