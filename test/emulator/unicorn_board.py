# SPDX-License-Identifier: GPL-3.0-or-later
"""A Cortex-M chip with our firmware, emulated: in the virtual world, or by hand."""

import ctypes
import importlib.util
import pathlib
import subprocess
import sys

import firmware_matrix

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "test" / "emulator"
SOURCES = ["unicorn_vmcu.c", "unicorn_core.c", "unicorn_rcc.c",
           "unicorn_periph.c", "unicorn_adc.c", "unicorn_spi.c", "unicorn_i2c.c",
           "unicorn_timer.c", "unicorn_usbfs.c", "unicorn_otg.c", "unicorn_rom.c",
           "unicorn_can.c", "unicorn_canhost.c", "unicorn_bxcan.c", "unicorn_mcan.c",
           "unicorn_fdcan.c", "unicorn_sdio.c", "unicorn_models.c",
           "unicorn_bus.c", "unicorn_lpc.c",
           "unicorn_lpc_clock.c", "unicorn_lpc_pins.c", "unicorn_lpc_uart.c",
           "unicorn_lpc_periph.c", "unicorn_lpc_buses.c", "unicorn_lpc_usb.c",
           "unicorn_lpc_can.c",
           "unicorn_sam.c", "unicorn_sam_clock.c", "unicorn_sam_pins.c",
           "unicorn_sam_periph.c", "unicorn_sam_adc.c", "unicorn_sam_buses.c",
           "unicorn_sam_udp.c", "unicorn_sam_usbhs.c", "unicorn_sam_can.c",
           "unicorn_rp2040.c", "unicorn_rp2040_flash.c", "unicorn_rp2040_io.c",
           "unicorn_rp2040_usb.c", "unicorn_rp2040_core1.c", "unicorn_pio.c",
           "unicorn_canwire.c", "unicorn_usbhost.c",
           "unicorn_samd.c", "unicorn_samd_io.c", "unicorn_samd_usb.c",
           "unicorn_samd_can.c"]
sys.path.append(str(ROOT / "test" / "firmware"))
from simboard import SimBoard  # noqa: E402

BYTE_TIME = 40e-6       # at 250000 baud
ANSWER_BYTES = 200      # what a command and its answers may need


def why_not():
    """What is missing for these tests, or an empty text."""
    if firmware_matrix.find_prefix("stm32f103") is None:
        return "needs gcc-arm-none-eabi"
    if not importlib.util.find_spec("unicorn"):
        return "needs the Python package unicorn"
    return ""


def build_adapter(folder):
    """Path of the shared object that wraps libunicorn and our models."""
    package = pathlib.Path(importlib.util.find_spec("unicorn").origin).parent
    path = folder / "unicorn_vmcu.so"
    subprocess.run(
        ["cc", "-std=gnu11", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra",
         "-Wshadow", "-Werror", "-I", str(ROOT / "klippy_ext" / "csrc"),
         "-I", str(package / "include"), *[str(FOLDER / s) for s in SOURCES],
         "-o", str(path), str(package / "lib" / "libunicorn.so.2"),
         "-Wl,-rpath," + str(package / "lib")], check=True)
    return path


def choose_chip(monkeypatch, out, chip, crystal=8000000):
    """What the adapter starts when power comes on; out: a built firmware."""
    constants = firmware_matrix.read_constants(out)
    monkeypatch.setenv("UNICORN_ELF", str(out / "klipper.elf"))
    monkeypatch.setenv("UNICORN_CHIP", chip)
    monkeypatch.setenv("UNICORN_HZ", str(constants["CLOCK_FREQ"]))
    monkeypatch.setenv("UNICORN_BAUD", str(constants.get("SERIAL_BAUD", 0)))
    monkeypatch.setenv("UNICORN_HSE", str(crystal))


class UnicornBoard(SimBoard):
    """Bytes take their time, one by one, and so does the program."""

    def _tx(self, ctx, clock, buf, size):
        self.pending = getattr(self, "pending", b"") + bytes(buf[:size])
        while self.pending and len(self.pending) >= self.pending[0]:
            block = self.pending[:self.pending[0]]
            self.pending = self.pending[len(block):]
            super()._tx(ctx, clock, block, len(block))

    def send_raw(self, data):
        super().send_raw(data)
        self.run_for((len(data) + ANSWER_BYTES) * BYTE_TIME)

    def find_pin(self, name):
        """Number of a pin by its name."""
        number = self.ops.find_pin(name.encode())
        assert number >= 0, name
        return number

    def read_stats(self):
        """(instructions, timer interrupts, instructions in those) so far."""
        stats = (ctypes.c_uint64 * 3)()
        self.library.unicorn_read_stats(stats)
        return tuple(stats)

    def read_delays(self):
        """Cycles with interrupts off, cycles in one interrupt, instructions of a
        timer interrupt at least and at most: the extremes since the last call.
        """
        delays = (ctypes.c_uint64 * 4)()
        self.library.unicorn_read_delays(delays, 1)
        return tuple(delays)

    def usb_text(self, index):
        """A string of the USB device, as the host has read it."""
        self.library.unicorn_usb_text.restype = ctypes.c_char_p
        return self.library.unicorn_usb_text(index).decode()

    def read_word(self, addr):
        """A register, by the firmware's debug command."""
        return self.query("debug_read", "debug_result", order=2, addr=addr)["val"]
