# SPDX-License-Identifier: GPL-3.0-or-later
"""Every configuration of test/configs builds, without warnings, and fits.

Builds go to out/matrix/<name>/, so that only what changed is built again.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONFIGS = sorted(p.stem for p in (ROOT / "test" / "configs").glob("*.config"))
# Division in software must not be reached from interrupts of a Cortex-M0
TOOLS = {"avr": "avr-", "stm32": "arm-none-eabi-"}


def read_conf(out):
    """{name: text} of a built configuration."""
    lines = (out / "auto.conf").read_text().splitlines()
    return dict(line[len("CONFIG_"):].split("=", 1) for line in lines)


def build(name):
    """Folder with the built firmware of a configuration."""
    out = ROOT / "out" / "matrix" / name
    out.mkdir(parents=True, exist_ok=True)
    result = subprocess.run(
        ["make", "-j%d" % (os.cpu_count() or 1,), "firmware", "OUT=%s/" % (out,),
         "KCONFIG_CONFIG=test/configs/%s.config" % (name,),
         "PYTHON=" + sys.executable], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "warning" not in (result.stdout + result.stderr).lower()
    return out


def read_sizes(prefix, elf):
    """(flash, memory) bytes of a program."""
    text = subprocess.run([prefix + "size", str(elf)], check=True,
                          capture_output=True, text=True).stdout
    code, data, bss = (int(w) for w in text.splitlines()[1].split()[:3])
    return code + data, data + bss


@pytest.mark.parametrize("name", CONFIGS)
def test_configuration_builds(name):
    text = (ROOT / "test/configs" / (name + ".config")).read_text()
    family = text.split("CONFIG_MACH_", 1)[1].split("=")[0].lower()
    prefix = TOOLS.get(family, "")
    if not shutil.which(prefix + "gcc"):
        pytest.skip("needs %sgcc" % (prefix,))
    out = build(name)
    conf = read_conf(out)
    constants = json.loads((out / "klipper.dict").read_text())["config"]
    assert constants["CLOCK_FREQ"] == int(conf["CLOCK_FREQ"])
    flash, memory = read_sizes(prefix, out / "klipper.elf")
    print("%-14s %6d bytes of flash, %6d of memory" % (name, flash, memory))
    if family == "stm32":
        room = int(conf["FLASH_SIZE"], 0) - (
            int(conf["FLASH_APPLICATION_ADDRESS"], 0) - int(conf["FLASH_BASE"], 0))
        assert flash <= room
        assert memory + int(conf["STACK_SIZE"]) < int(conf["RAM_SIZE"], 0)
