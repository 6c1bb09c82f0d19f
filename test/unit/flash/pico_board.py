# SPDX-License-Identifier: GPL-3.0-or-later
"""An RP2040 or RP2350 on USB, in folders that stand for /dev, /sys and /proc: its
running firmware, and the drive of its ROM.  Time goes on when the host waits."""

import os
import shutil
import struct
import termios
import tty

INFO = {
    "rp2040": ("2e8a", "0003", 0xE48BFF56, "UF2 Bootloader v3.0\nModel: Raspberry Pi "
               "RP2\nBoard-ID: RPI-RP2\n"),
    "rp2350": ("2e8a", "000f", 0xE48BFF59, "UF2 Bootloader v1.0\nModel: Raspberry Pi "
               "RP2350\nBoard-ID: RP2350\n")}
BLOCK = "/dev/sdb1"
DELAY = 5                       # waits that each step takes
MAGIC = (0x0A324655, 0x9E5D5157)
MAGIC_END = 0x0AB16F30


class PicoBoard:
    """Call wait() whenever time goes by."""

    def __init__(self, folder, mcu="rp2040"):
        self.vendor, self.product, self.family, info = INFO[mcu]
        self.mcu = mcu
        self.root, self.drive = folder / "root", folder / "a drive"
        for name in ("dev/serial/by-id", "sys/bus/usb/devices", "proc"):
            (self.root / name).mkdir(parents=True)
        (self.root / "proc/mounts").write_text("/dev/sda1 / ext4 rw 0 0\n")
        self.drive.mkdir()
        (self.drive / "INFO_UF2.TXT").write_text(info)
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave, termios.TCSANOW)
        self.link = (self.root / "dev/serial/by-id"
                     / ("usb-Klipper_%s_E66138935F-if00" % (mcu,)))
        self.usb = self.root / "sys/bus/usb/devices/1-1"
        self.automounts = True
        self.is_deaf = self.is_dead = False     # of the touch; of what was written
        self.flash = {}                 # what was written, by address
        self.clock, self.due, self.next_step = 0, 0, None

    def close(self):
        os.close(self.master)
        os.close(self.slave)

    # ---- What it shows

    def run_firmware(self):
        """Its serial port comes."""
        self.link.symlink_to(os.ttyname(self.slave))

    def show_drive(self):
        """The boot loader's USB device, and its drive."""
        (self.usb / "1-1:1.0/host2/target2:0:0/2:0:0:0/block/sdb/sdb1").mkdir(
            parents=True)
        (self.usb / "idVendor").write_text(self.vendor + "\n")
        (self.usb / "idProduct").write_text(self.product + "\n")
        (self.root / BLOCK[1:]).write_text("")
        if self.automounts:
            self.after(self.mount)

    def mount(self):
        with open(self.root / "proc/mounts", "a", encoding="utf-8") as file:
            file.write("%s %s vfat rw 0 0\n"
                       % (BLOCK, str(self.drive).replace(" ", "\\040")))

    def hide_drive(self):
        """The folder is still there, as the kernel has it cached."""
        shutil.rmtree(self.usb)
        (self.root / BLOCK[1:]).unlink()
        if not self.is_dead:
            self.after(self.run_firmware)

    # ---- What it does

    def after(self, step):
        self.due, self.next_step = self.clock + DELAY, step

    def wait(self, seconds):
        """The host waits."""
        self.clock += 1
        if self.next_step:
            if self.clock >= self.due:
                step, self.next_step = self.next_step, None
                step()
        elif self.link.is_symlink() and not self.is_deaf:
            if termios.tcgetattr(self.slave)[5] == termios.B1200:
                termios.tcsetattr(self.slave, termios.TCSANOW, self._plain_mode())
                self.link.unlink()
                self.after(self.show_drive)
        elif self.usb.exists() and self.take_file():
            self.after(self.hide_drive)

    def _plain_mode(self):
        mode = termios.tcgetattr(self.slave)
        mode[4] = mode[5] = termios.B9600
        return mode

    def take_file(self):
        """True once all blocks of a file are there that are for this chip."""
        files = list(self.drive.glob("*.uf2"))
        data = files[0].read_bytes() if files else b""
        seen = set()
        for i in range(0, len(data), 512):
            words = struct.unpack("<8I", data[i:i + 32])
            end, = struct.unpack("<I", data[i + 508:i + 512])
            if words[:2] == MAGIC and end == MAGIC_END and words[7] == self.family:
                for k in range(words[4]):
                    self.flash[words[3] + k] = data[i + 32 + k]
                seen.add(words[5])
                if len(seen) == words[6]:
                    return True
        return False
