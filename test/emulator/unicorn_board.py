# SPDX-License-Identifier: GPL-3.0-or-later
"""An STM32 with our firmware, emulated, as an mcu of the virtual world."""

import importlib.util
import json
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "test" / "emulator"
SOURCES = ["unicorn_vmcu.c", "unicorn_core.c", "unicorn_rcc.c",
           "unicorn_periph.c", "unicorn_models.c"]


def why_not():
    """What is missing for these tests, or an empty text."""
    if not shutil.which("arm-none-eabi-gcc"):
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


def build_firmware(folder, chip, options=""):
    """Folder with the ELF of a chip, from its configuration of the tests."""
    folder.mkdir(parents=True, exist_ok=True)
    config = folder / "config"
    config.write_text(
        (ROOT / "test/configs" / (chip + ".config")).read_text() + options)
    result = subprocess.run(
        ["make", "firmware", "OUT=%s/" % (folder,), "KCONFIG_CONFIG=%s" % (config,),
         "PYTHON=" + sys.executable], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


def read_constants(folder):
    """The constants of a built firmware's dictionary."""
    return json.loads((folder / "klipper.dict").read_text())["config"]


def choose_chip(monkeypatch, folder, chip, crystal=8000000):
    """What the adapter starts when power comes on."""
    constants = read_constants(folder)
    monkeypatch.setenv("UNICORN_ELF", str(folder / "klipper.elf"))
    monkeypatch.setenv("UNICORN_CHIP", chip)
    monkeypatch.setenv("UNICORN_HZ", str(constants["CLOCK_FREQ"]))
    monkeypatch.setenv("UNICORN_BAUD", str(constants["SERIAL_BAUD"]))
    monkeypatch.setenv("UNICORN_HSE", str(crystal))
