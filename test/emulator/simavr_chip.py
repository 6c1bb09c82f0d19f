# SPDX-License-Identifier: GPL-3.0-or-later
"""An AVR chip with our firmware, as a micro-controller of the virtual world."""

import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = "/usr/include/simavr/sim_avr.h"
# Port of the analog inputs 0 to 7
ADC_PORTS = {"atmega2560": "F", "atmega644p": "A"}


def is_installed():
    """True where libsimavr can be compiled against."""
    return os.path.exists(HEADER)


def build_adapter(folder):
    """Path of the shared object that wraps libsimavr."""
    path = folder / "simavr_vmcu.so"
    subprocess.run(
        ["cc", "-std=gnu11", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra",
         "-Werror", "-I", str(ROOT / "klippy_ext" / "csrc"),
         "-I", "/usr/include/simavr", str(ROOT / "test/emulator/simavr_vmcu.c"),
         "-o", str(path), "-lsimavr", "-lelf"], check=True)
    return path


def build_firmware(folder, chip):
    """Path of the ELF of a chip, from its configuration of the tests."""
    subprocess.run(
        ["make", "firmware", "OUT=%s/" % (folder,),
         "KCONFIG_CONFIG=test/configs/%s.config" % (chip,),
         "PYTHON=" + sys.executable], cwd=ROOT, check=True, capture_output=True)
    return folder / "klipper.elf"


def choose_chip(monkeypatch, elf, chip):
    """What the adapter starts when power comes on."""
    monkeypatch.setenv("SIMAVR_ELF", str(elf))
    monkeypatch.setenv("SIMAVR_MCU", chip)
    monkeypatch.setenv("SIMAVR_ADC_PORT", str(ord(ADC_PORTS[chip])))
