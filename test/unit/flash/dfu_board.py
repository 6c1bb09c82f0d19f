# SPDX-License-Identifier: GPL-3.0-or-later
"""Boot loaders that speak DFU, behind model_usb.c: for the real dfu-util.

`DfuSeBoard` is the one in ROM of an STM32 (ST's notes AN3156 and UM0391, on USB's
DFU 1.1); `DfuBoard` the plain protocol of stm32duino's and Smoothieware's.
"""

import contextlib
import os
import pathlib
import socket
import struct
import subprocess
import threading

FOLDER = pathlib.Path(__file__).parent
ERROR_PIPE = -9                 # of libusb: the device refuses a request
# States and faults of the protocol
IDLE, DNLOAD_SYNC, DNBUSY, DNLOAD_IDLE = 2, 3, 4, 5
MANIFEST_SYNC, MANIFEST, WAIT_RESET, UPLOAD_IDLE, ERROR = 6, 7, 8, 9, 10
OK, ERR_TARGET, ERR_VENDOR, ERR_STALLED = 0, 0x01, 0x0B, 0x0F
# Requests of the class
DETACH, DNLOAD, UPLOAD, GETSTATUS, CLRSTATUS, GETSTATE, ABORT = range(7)
GET_DESCRIPTOR, SET_INTERFACE = 6, 11


def build_library(folder):
    """The libusb-1.0 in a folder that dfu-util is given."""
    library = folder / "libusb-1.0.so.0"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Wshadow",
                    "-Werror", str(FOLDER / "model_usb.c"), "-o", str(library)],
                   check=True)


class Refused(Exception):
    """The device stalls the transfer."""


class Gone(Exception):
    """The device leaves the bus."""


class DfuBoard(threading.Thread):
    """Blocks of a download come one after the other, to `start` of `memory`."""

    USB_ID = (0x1EAF, 0x0003)
    VERSION = 0x0201
    ALTERNATES = ("no", "no", "flash")      # names of the settings
    TRANSFER = 1024
    TOLERANT = 0x04                         # of ATTRIBUTES: no reset at the end
    ATTRIBUTES = 0x0B                       # download, upload, will detach
    DFU_VERSION = 0x0110

    def __init__(self, path, start=0x2000):
        super().__init__(daemon=True)
        self.path, self.start_at = path, start
        self.memory = bytearray(b"\x5a" * 0x80000)      # what was there
        self.state, self.status, self.alternate = IDLE, OK, 0
        self.offset, self.block = start, b""
        self.is_gone = self.is_reset = False
        self.failure = None
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.listener.bind(str(path))
        self.listener.listen()

    # ---- The bus

    def run(self):
        with contextlib.suppress(OSError, Gone):
            while True:
                link, _ = self.listener.accept()
                with link:
                    self._serve(link)
        self.listener.close()
        os.unlink(self.path)
        self.is_gone = True

    def close(self):
        """Unplug; an AssertionError of the model is the test's."""
        with contextlib.suppress(OSError):
            self.listener.shutdown(socket.SHUT_RDWR)
        self.join()
        if self.failure:
            raise self.failure

    def _serve(self, link):
        with contextlib.suppress(EOFError, ConnectionError):
            while True:
                if take(link, 1) == b"R":
                    self.is_reset = True
                    raise Gone
                kind, request, value, index, length = struct.unpack(
                    "<BBHHH", take(link, 8))
                data = b"" if kind & 0x80 else take(link, length)
                try:
                    answer = self.handle(kind, request, value, data, length)
                    size = len(answer) if kind & 0x80 else length
                    link.sendall(struct.pack("<i", size) + answer)
                except Refused:
                    link.sendall(struct.pack("<i", ERROR_PIPE))
                except AssertionError as err:
                    self.failure = err
                    raise Gone from None

    def handle(self, kind, request, value, data, length):
        """Answer of a control transfer."""
        if kind & 0x60 == 0x20:
            return self.handle_dfu(request, value, data, length)[:length]
        if request == GET_DESCRIPTOR:
            return self.descriptor(value >> 8, value & 0xFF)[:length]
        assert request == SET_INTERFACE, request
        self.alternate = value
        return b""

    def descriptor(self, kind, index):
        if kind == 1:
            return struct.pack("<BBHBBBBHHHBBBB", 18, 1, 0x100, 0, 0, 0, 64,
                               *self.USB_ID, self.VERSION, 1, 2, 3, 1)
        if kind == 2:
            body = b"".join(struct.pack("<9B", 9, 4, 0, i, 0, 0xFE, 1, 2, 4 + i)
                            for i in range(len(self.ALTERNATES)))
            body += struct.pack("<BBBHHH", 9, 0x21, self.ATTRIBUTES, 255,
                                self.TRANSFER, self.DFU_VERSION)
            return struct.pack("<BBHBBBBB", 9, 2, 9 + len(body), 1, 1, 0, 0xC0,
                               50) + body
        if kind == 3:
            texts = ("Maker", "Boot loader", "FFFFFFFEFFFF", *self.ALTERNATES)
            if index > len(texts):
                raise Refused
            data = texts[index - 1].encode("utf-16-le") if index else b"\x09\x04"
            return bytes([2 + len(data), 3]) + data
        raise Refused

    # ---- The protocol

    def handle_dfu(self, request, value, data, length):
        if request == GETSTATUS:
            return self._get_status()
        if request == GETSTATE:
            return bytes([self.state])
        if request == CLRSTATUS:
            self._expect(ERROR)
            self.state, self.status = IDLE, OK
        elif request == ABORT:
            self._expect(IDLE, DNLOAD_IDLE, UPLOAD_IDLE)
            self.state = IDLE
        elif request == DNLOAD:
            self._expect(IDLE, DNLOAD_IDLE)
            self.block = (value, data)
            self.state = DNLOAD_SYNC if data else MANIFEST_SYNC
        elif request == UPLOAD:
            self._expect(IDLE, UPLOAD_IDLE)
            answer = self.upload(value, length)
            self.state = UPLOAD_IDLE if len(answer) == length else IDLE
            return answer
        else:
            self._refuse()
        return b""

    def _expect(self, *states):
        if self.state not in states:
            self._refuse()

    def _refuse(self, status=ERR_STALLED):
        self.state, self.status = ERROR, status
        raise Refused

    def _get_status(self):
        if self.state == DNLOAD_SYNC:
            self.state = DNBUSY
            self.status = self.download(*self.block)
        elif self.state == DNBUSY:
            self.state = ERROR if self.status else DNLOAD_IDLE
        elif self.state == MANIFEST_SYNC:
            self.state = MANIFEST
            self.manifest()
        wait = 1 if self.state == DNBUSY else 0
        return struct.pack("<BBHBB", self.status, wait, 0, self.state, 0)

    def manifest(self):
        """Ready for the next download, or the firmware starts after a reset."""
        is_tolerant = self.ATTRIBUTES & self.TOLERANT
        self.state, self.offset = IDLE if is_tolerant else WAIT_RESET, self.start_at

    def download(self, number, data):
        """Take a block; returns a fault."""
        assert self.alternate == len(self.ALTERNATES) - 1, self.alternate
        self.memory[self.offset:self.offset + len(data)] = data
        self.offset += len(data)
        return OK

    def upload(self, number, length):
        start = self.start_at + number * self.TRANSFER
        return bytes(self.memory[start:start + length])


class SmoothieBoard(DfuBoard):
    """The boot loader that LPC176x boards may have: it keeps the first 16 KiB."""

    USB_ID = (0x1D50, 0x6015)
    ALTERNATES = ("Bootloader",)
    ATTRIBUTES = 0x0D
    TRANSFER = 64

    def __init__(self, path):
        super().__init__(path, 0x4000)


class DfuSeBoard(DfuBoard):
    """ROM of an STM32F446xE: sectors of flash, addresses by special blocks."""

    USB_ID = (0x0483, 0xDF11)
    VERSION = 0x2200
    FLASH = 0x08000000
    SECTORS = ((4, 16), (1, 64), (3, 128))  # count, KiB
    TRANSFER = 2048
    DFU_VERSION = 0x011A
    SET_ADDRESS, ERASE, READ_UNPROTECT = 0x21, 0x41, 0x92

    def __init__(self, path):
        layout = ",".join("%02d*%03dKg" % sector for sector in self.SECTORS)
        self.ALTERNATES = ("@Internal Flash  /0x%08X/%s" % (self.FLASH, layout),
                           "@Option Bytes  /0x1FFFC000/01*016 e",
                           "@OTP Memory /0x1FFF7800/01*512 e,01*016 e",
                           "@Device Feature/0xFFFF0000/01*004 e")
        super().__init__(path)
        self.pointer = self.FLASH
        self.started_at = None
        self.erased = []                    # addresses of sectors
        self.is_protected = False
        self.bad_cells = set()              # they stay as they are
        self.tells_that_it_leaves = True

    def find_sector(self, addr):
        """(offset, size) of a sector; None if there is no flash."""
        offset = 0
        for count, size in self.SECTORS:
            for _ in range(count):
                if offset <= addr - self.FLASH < offset + size * 1024:
                    return offset, size * 1024
                offset += size * 1024
        return None

    def download(self, number, data):
        assert self.alternate == 0, self.alternate
        if self.is_protected:
            return ERR_VENDOR
        if number == 0:
            return self._special(data)
        assert number >= 2, number
        start = self.pointer + (number - 2) * self.TRANSFER - self.FLASH
        if start < 0 or start + len(data) > len(self.memory):
            return ERR_TARGET
        for i, byte in enumerate(data, start):
            if i not in self.bad_cells:
                self.memory[i] &= byte      # what flash can do
        return OK

    def _special(self, data):
        command, addr = data[0], int.from_bytes(data[1:], "little")
        if command == self.ERASE and len(data) == 5:
            sector = self.find_sector(addr)
            if not sector:
                return ERR_TARGET
            self.memory[sector[0]:sum(sector)] = b"\xff" * sector[1]
            self.erased.append(self.FLASH + sector[0])
        elif command == self.ERASE and len(data) == 1:
            self.memory[:] = b"\xff" * len(self.memory)
            self.erased.append("all")
        elif command == self.SET_ADDRESS and self.find_sector(addr):
            self.pointer = addr
        else:
            return ERR_TARGET
        return OK

    def upload(self, number, length):
        if self.is_protected:
            self._refuse(ERR_VENDOR)
        if number == 0:
            return bytes([0, self.SET_ADDRESS, self.ERASE, self.READ_UNPROTECT])
        assert number >= 2, number
        start = self.pointer + (number - 2) * self.TRANSFER - self.FLASH
        return bytes(self.memory[start:start + length])

    def manifest(self):
        """The chip goes on at the address, and its boot loader is no more."""
        self.started_at = self.pointer
        if not self.tells_that_it_leaves:
            raise Gone

    def handle(self, kind, request, value, data, length):
        if self.state == MANIFEST:
            raise Gone
        return super().handle(kind, request, value, data, length)


def take(link, size):
    """Exactly that many bytes; EOFError if the other side hung up."""
    data = b""
    while len(data) < size:
        more = link.recv(size - len(data))
        if not more:
            raise EOFError
        data += more
    return data
