# SPDX-License-Identifier: GPL-3.0-or-later
"""An AVR chip with our firmware, as a micro-controller of the virtual world."""

import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = "/usr/include/simavr/sim_avr.h"
SOURCES = ["simavr_vmcu.c", "simavr_bus.c", "simavr_usb.c",
           "simavr_meter.c"]


def list_pins(port, bits):
    return ["P%s%s" % (port, bit) for bit in bits]


F8 = list_pins("F", "01234567")
MEGA = F8 + list_pins("K", "01234567")
X4 = list_pins("A", "01234567")
X8 = list_pins("C", "012345") + ["PE2", "PE3"]
U4 = (list_pins("F", "01") + ["PF0", "PF0"] + list_pins("F", "4567")
      + ["PD4", "PD6", "PD7", "PB4", "PB5", "PB6"])
# Pins of the analog inputs 0, 1 ..
CHIPS = {
    "atmega168": X8, "atmega328": X8, "atmega328p": X8, "atmega328p_reduced": X8,
    "atmega644p": X4, "atmega1284p": X4, "atmega1280": MEGA, "atmega2560": MEGA,
    "atmega32u4": U4, "at90usb646": F8, "at90usb1286": F8,
}
# libsimavr has none of these: the core of a 32U4 with other memories
AT90USB = {"at90usb646": (0xFFFF, 0x10FF, 0x7FF),
           "at90usb1286": (0x1FFFF, 0x20FF, 0xFFF)}


def is_installed():
    """True where libsimavr can be compiled against."""
    return os.path.exists(HEADER)


def build_adapter(folder):
    """Path of the shared object that wraps libsimavr."""
    path = folder / "simavr_vmcu.so"
    subprocess.run(
        ["cc", "-std=gnu11", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra",
         "-Werror", "-I", str(ROOT / "klippy_ext" / "csrc"),
         "-I", "/usr/include/simavr",
         *[str(ROOT / "test/emulator" / name) for name in SOURCES],
         "-o", str(path), "-lsimavr", "-lelf"], check=True)
    return path


def build_firmware(folder, chip, options=()):
    """Path of the ELF of a chip, from its configuration of the tests and more
    options."""
    config = folder / "chosen.config"
    text = (ROOT / "test/configs" / (chip + ".config")).read_text()
    config.write_text(text + "".join("CONFIG_%s\n" % o for o in options))
    subprocess.run(
        ["make", "firmware", "OUT=%s/" % (folder,),
         "KCONFIG_CONFIG=%s" % (config,),
         "PYTHON=" + sys.executable], cwd=ROOT, check=True, capture_output=True)
    return folder / "klipper.elf"


def list_settings(elf, chip):
    """{name: text}: what the adapter starts when power comes on."""
    mcu = chip.split("_")[0]
    settings = {"SIMAVR_ELF": str(elf), "SIMAVR_MCU": mcu,
                "SIMAVR_ADC_PINS": " ".join(CHIPS[chip])}
    if mcu in AT90USB:
        settings["SIMAVR_CORE"] = "atmega32u4"
        for name, value in zip(("FLASHEND", "RAMEND", "E2END"), AT90USB[mcu],
                               strict=True):
            settings["SIMAVR_" + name] = str(value)
    return settings


def choose_chip(monkeypatch, elf, chip):
    """Let the adapter start a chip when power comes on."""
    for name, value in list_settings(elf, chip).items():
        monkeypatch.setenv(name, value)
