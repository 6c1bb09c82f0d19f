# SPDX-License-Identifier: GPL-3.0-or-later
"""The host on the kernel's USB: an RP2040 in its ROM, then its serial port.

A USB device controller that is a loop (dummy_hcd) shows the drive of a boot loader
first; when that has all of the UF2 file, it becomes a serial port (CDC ACM) with
the linux firmware behind it.
"""

import os
import pathlib
import re
import struct
import sys
import threading
import time

import relay
from linux_machine import Machine

from klippy.flash import uf2

GADGETS = pathlib.Path("/sys/kernel/config/usb_gadget")
IMAGE = bytes((i * 7 + i // 256) & 0xFF for i in range(20000))
START, FAMILY = 0x10000000, 0xE48BFF56
SECTOR, PARTITION = 512, 63
SECTORS, FAT_SECTORS, ROOT_ENTRIES, CLUSTER = 32768, 64, 512, 4
INFO = b"UF2 Bootloader v3.0\r\nModel: Raspberry Pi RP2\r\nBoard-ID: RPI-RP2\r\n"
PERIOD = .05


def make_drive():
    """A disk with one partition of FAT16, which has INFO_UF2.TXT in it."""
    boot = struct.pack(
        "<3s8sHBHBHHBHHHIIBBBI11s8s", b"\xeb\x3c\x90", b"MSDOS5.0", SECTOR, CLUSTER, 1,
        1, ROOT_ENTRIES, SECTORS, 0xF8, FAT_SECTORS, 63, 255, PARTITION, 0, 0x80, 0,
        0x29, 1, b"RPI-RP2    ", b"FAT16   ").ljust(510, b"\0") + b"\x55\xaa"
    fat = struct.pack("<3H", 0xFFF8, 0xFFFF, 0xFFFF).ljust(
        FAT_SECTORS * SECTOR, b"\0")
    entry = struct.pack("<11sB14sHI", b"INFO_UF2TXT", 0x20, b"", 2, len(INFO))
    folder = entry.ljust(ROOT_ENTRIES * 32, b"\0")
    start = b"\0" * 446 + struct.pack(
        "<B3sB3sII", 0, b"\1\1\0", 0x0E, b"\1\1\0", PARTITION, SECTORS)
    start = start.ljust(510, b"\0") + b"\x55\xaa"
    data = start.ljust(PARTITION * SECTOR, b"\0") + boot + fat + folder + INFO
    return data.ljust((PARTITION + SECTORS) * SECTOR, b"\0")


def read_flash(path):
    """What the ROM has, once it has all of a file: blocks count, not files."""
    blocks, total = {}, None
    data = path.read_bytes()
    for i in range(0, len(data), SECTOR):
        if data[i:i + 4] == b"UF2\n":
            words = struct.unpack("<8I", data[i:i + 32])
            assert words[7] == FAMILY, hex(words[7])
            blocks[words[3]], total = data[i + 32:i + 32 + words[4]], words[6]
    if len(blocks) != total:
        return b""
    return b"".join(blocks[addr] for addr in sorted(blocks))


class Gadget:
    """A USB device: its ids, and one function with options."""

    def __init__(self, name, usb_id, function, options=()):
        self.folder = GADGETS / name
        vendor, product = usb_id.split(":")
        self.folder.mkdir()
        self._set("idVendor", "0x" + vendor)
        self._set("idProduct", "0x" + product)
        (self.folder / "strings/0x409").mkdir()
        self._set("strings/0x409/serialnumber", "E66138935F")
        (self.folder / "configs/c.1").mkdir()
        place = self.folder / "functions" / function
        place.mkdir()
        for option, value in options:
            self._set("functions/%s/%s" % (function, option), value)
        (self.folder / "configs/c.1" / function).symlink_to(place)

    def _set(self, name, value):
        (self.folder / name).write_text(str(value))

    def plug(self):
        self._set("UDC", os.listdir("/sys/class/udc")[0])

    def unplug(self):
        self._set("UDC", "\n")


class Board(threading.Thread):
    """In its ROM until there is firmware, which it starts."""

    def __init__(self):
        super().__init__(daemon=True)
        self.disk = relay.FOLDER / "disk"
        self.disk.write_bytes(make_drive())
        self.rom = Gadget("rom", "2e8a:0003", "mass_storage.usb0",
                          [("lun.0/removable", 1), ("lun.0/file", self.disk)])
        self.firmware = Gadget("firmware", "1d50:614e", "acm.usb0")
        self.flash = b""
        self.rom.plug()

    def run(self):
        while not self.flash:
            time.sleep(PERIOD)
            self.flash = read_flash(self.disk)
        self.rom.unplug()
        self.firmware.plug()


class UsbMachine(Machine):
    """Its firmware is behind the gadget's serial port."""

    def open_link(self):
        self.relay = relay.Relay(self.run.link, relay.open_terminal("/dev/ttyGS0"))
        self.relay.start()
        return "serial: /dev/ttyACM0"


def check_flash():
    """`klippy firmware flash` finds the boot loader, mounts its drive, and waits."""
    out = relay.FOLDER / "out"
    out.mkdir()
    (out / "klipper.uf2").write_bytes(uf2.convert(IMAGE, START, FAMILY))
    (out / "auto.conf").write_text(
        'CONFIG_MCU="rp2040"\nCONFIG_BOARD_DIRECTORY="rp2040"\nCONFIG_USBSERIAL=y\n')
    board = Board()
    board.start()
    flash = (sys.executable, "-m", "klippy", "firmware")
    while "2e8a:0003" not in relay.run(*flash, "list"):
        time.sleep(PERIOD)
    relay.ok("listed")
    told = relay.run(*flash, "flash", "--out", out)
    assert board.flash[:len(IMAGE)] == IMAGE
    assert "it is back: /dev/ttyACM0" in told, told
    assert not re.search(r" /mnt/klippy-", pathlib.Path("/proc/mounts").read_text())
    relay.ok("flashed")


def main(program):
    relay.run("/bin/busybox", "mount", "-t", "configfs", "none", "/sys/kernel/config")
    check_flash()
    machine = UsbMachine(pathlib.Path(program), relay.FOLDER, *relay.OPTIONS)
    relay.check_print(machine)
    assert min(machine.relay.count.values()) > 500
    assert machine.stop() == 0
    relay.ok("stopped")
    sys.stdout.flush()
    os._exit(0)                         # the relay is a thread that waits


main(*sys.argv[1:])
