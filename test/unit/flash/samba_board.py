# SPDX-License-Identifier: GPL-3.0-or-later
"""SAM-BA on a pseudo terminal, for bossac: the monitor that SAM chips have in ROM,
and the Arduino boot loader of a SAM D21 with its commands X, Y and Z.

bossac sends small programs into the chip's memory and has them run: an emulated
processor runs them.  Flash is written by pages, as its controller does it.
"""

import struct
import threading

import unicorn
from pty_board import PtyBoard
from unicorn import arm_const

NOISE = b"\x80\r\n#"            # from which a monitor finds its baud rate
SIZES = {"O": 1, "H": 2, "W": 4}
RETURN = 0x1000                 # where a program that has ended goes on


class Sam4eBoard(PtyBoard):
    """A SAM4E8E in ROM (11157, 22 and 23): 512 KiB of flash at 0x400000."""

    VERSION = b"v1.12 Oct  9 2013 13:21:52"
    FLASH, PAGE, RAM, RAM_SIZE = 0x400000, 512, 0x20000000, 0x20000
    REGISTERS = {0x4: 0x00800101, 0xE000ED00: 0x410FC241, 0x400E0740: 0xA3CC0CE0,
                 0x400E0744: 0x00120208}
    FCR, FSR, FRR, RESET = 0x400E0A04, 0x400E0A08, 0x400E0A0C, 0x400E1800
    ERASE_ALL, WRITE_PAGE, SET_BIT, GET_BITS = 0x05, 0x01, 0x0B, 0x0D

    def __init__(self):
        super().__init__()
        self.memory = bytearray(b"\x5a" * 0x80000)      # what was there
        self.latch, self.ram = {}, bytearray(self.RAM_SIZE)
        self.gpnvm, self.answer = 0, 0
        self.was_reset = threading.Event()
        self.n_programs = 0

    def serve(self):
        text = self._take_line()
        name, args = chr(text[0]), [int(word, 16) for word in text[1:].split(b",")
                                    if word]
        if name == "N":
            self.give(b"\n\r")
        elif name == "V":
            self.give(self.VERSION + b"\n\r")
        elif name in "ohw":
            self.give(self.read(args[0], 4)[:SIZES[name.upper()]])
        elif name in SIZES:
            self.write(args[0], struct.pack("<I", args[1])[:SIZES[name]])
        elif name == "S":
            self.write(args[0], self.take(args[1]))
        elif name == "R":
            self.give(self.read(args[0], args[1]))
        elif name == "G":
            self.go(args[0])
        else:
            self.serve_more(name, args)

    def _take_line(self):
        text = b""
        while True:
            byte = self.take(1)
            if byte == b"#" and text:
                return text
            if byte not in NOISE or text:
                text += byte

    def serve_more(self, name, args):
        raise AssertionError("SAM-BA in ROM has no command %s" % (name,))

    # ---- Memory

    def read(self, addr, size):
        if addr == self.FSR:
            return b"\x01\0\0\0"
        if addr == self.FRR:
            return struct.pack("<I", self.answer)
        if addr in self.REGISTERS or addr < self.FLASH:
            return struct.pack("<I", self.REGISTERS.get(addr, 0))
        if self.RAM <= addr:
            start = addr - self.RAM
            assert start + size <= self.RAM_SIZE, hex(addr)
            return bytes(self.ram[start:start + size])
        start = addr - self.FLASH
        assert start + size <= len(self.memory), hex(addr)
        return bytes(self.memory[start:start + size])

    def write(self, addr, data):
        if addr == self.FCR:
            self.flash_command(int.from_bytes(data, "little"))
        elif addr == self.RESET:
            self.was_reset.set()
        elif self.RAM <= addr < self.RAM + self.RAM_SIZE:
            self.ram[addr - self.RAM:addr - self.RAM + len(data)] = data
        elif self.FLASH <= addr < self.FLASH + len(self.memory):
            for i, byte in enumerate(data):
                self.latch[(addr + i) % self.PAGE] = byte

    def flash_command(self, word):
        """What the flash controller is asked for: by key, argument, number."""
        assert word >> 24 == 0x5A, hex(word)
        argument, command = word >> 8 & 0xFFFF, word & 0xFF
        if command == self.ERASE_ALL:
            self.memory[:] = b"\xff" * len(self.memory)
        elif command == self.WRITE_PAGE:
            for i, byte in self.latch.items():
                self.memory[argument * self.PAGE + i] &= byte
            self.latch = {}
        elif command == self.SET_BIT:
            self.gpnvm |= 1 << argument
        elif command == self.GET_BITS:
            self.answer = self.gpnvm
        else:
            raise AssertionError("flash command 0x%x" % (word,))

    # ---- Programs

    def go(self, addr):
        """Run from a table as the core's: stack, program."""
        stack, start = struct.unpack("<2I", self.read(addr, 8))
        cpu = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB
                         | unicorn.UC_MODE_MCLASS)
        cpu.mem_map(self.RAM, self.RAM_SIZE)
        cpu.mem_write(self.RAM, bytes(self.ram))
        cpu.mem_map(self.FLASH, len(self.memory))
        cpu.mem_write(self.FLASH, bytes(self.memory))
        cpu.mem_map(0, 0x2000)
        cpu.hook_add(unicorn.UC_HOOK_MEM_WRITE, self._note_write)
        cpu.reg_write(arm_const.UC_ARM_REG_SP, stack)
        cpu.reg_write(arm_const.UC_ARM_REG_LR, RETURN | 1)
        cpu.emu_start(start | 1, RETURN, count=1000000)
        self.ram[:] = cpu.mem_read(self.RAM, self.RAM_SIZE)
        self.n_programs += 1

    def _note_write(self, cpu, access, addr, size, value, data):
        if not self.RAM <= addr < self.RAM + self.RAM_SIZE:
            self.write(addr, (value & (1 << 8 * size) - 1).to_bytes(size, "little"))


class SamdBoard(Sam4eBoard):
    """A SAM D21 with the Arduino boot loader in its first 8 KiB."""

    VERSION = b"v2.0 [Arduino:XYZ] Mar 19 2018 09:45:14"
    FLASH, PAGE, RAM_SIZE = 0, 64, 0x8000
    REGISTERS = {0xE000ED00: 0x410CC601, 0x41002018: 0x10010005}
    RESET, LOADER = 0xE000ED0C, 0x2000

    def __init__(self):
        super().__init__()
        self.memory = bytearray(b"\x5a" * 0x40000)
        self.source = 0

    def serve_more(self, name, args):
        if name == "X":
            assert args[0] >= self.LOADER, "the boot loader erases itself"
            self.memory[args[0]:] = b"\xff" * (len(self.memory) - args[0])
        elif name == "Y" and not args[1]:
            self.source = args[0]
        elif name == "Y":
            assert args[0] >= self.LOADER, "the boot loader is overwritten"
            self.memory[args[0]:args[0] + args[1]] = self.read(self.source, args[1])
        elif name == "Z":
            self.give(b"Z%08X#\n\r" % (crc16(self.read(*args)),))
            return
        self.give(name.encode() + b"\n\r")


def crc16(data):
    """CCITT, from 0."""
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return crc
