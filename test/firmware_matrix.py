# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware of the configurations in test/configs, built once for all tests.

Builds go to out/matrix/<name>/, so that only what changed is built again.
"""

import functools
import json
import os
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
CONFIGS = sorted(p.stem for p in (ROOT / "test" / "configs").glob("*.config"))
ARM = ("stm32", "lpc176x", "rpxxxx", "atsam", "atsamd")
PREFIXES = {"avr": "avr-", "pru": "pru-elf-",
            **dict.fromkeys(ARM, "arm-none-eabi-")}
# scripts/build_pru_tools.sh puts them there
PRU_TOOLS = pathlib.Path(os.environ.get("KLIPPY_PRU_TOOLS")
                         or pathlib.Path.home() / ".cache" / "klippy-pru") / "bin"


def find_family(name):
    """Family of the chip of a configuration: avr, stm32, linux, simu."""
    text = (ROOT / "test/configs" / (name + ".config")).read_text()
    return text.split("CONFIG_MACH_", 1)[1].split("=")[0].lower()


def find_prefix(name):
    """Prefix of the compiler's name; None if it is not installed."""
    prefix = PREFIXES.get(find_family(name), "")
    if shutil.which(prefix + "gcc"):
        return prefix
    local = "%s/%s" % (PRU_TOOLS, prefix)
    return local if shutil.which(local + "gcc") else None


def say_missing(name):
    """Why a configuration cannot be built where find_prefix() finds nothing."""
    if find_family(name) == "pru":
        return "needs pru-elf-gcc: sh scripts/build_pru_tools.sh (20 minutes)"
    return "needs %sgcc for %s" % (PREFIXES[find_family(name)], name)


@functools.cache
def build(name, options=(), folder=None):
    """Folder with the built firmware of a configuration and more options."""
    out = folder or ROOT / "out" / "matrix" / name
    out.mkdir(parents=True, exist_ok=True)
    config = out / "chosen.config"
    text = (ROOT / "test/configs" / (name + ".config")).read_text()
    config.write_text(text + "".join("CONFIG_%s\n" % o for o in options))
    # always by the same name: make's dependencies have it in them
    name_of_out = os.path.relpath(out, ROOT)
    result = subprocess.run(
        ["make", "-j%d" % (os.cpu_count() or 1,), "firmware",
         "OUT=%s/" % (name_of_out,),
         "KCONFIG_CONFIG=%s" % (config,), "PYTHON=" + sys.executable],
        cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "warning" not in (result.stdout + result.stderr).lower(), result.stderr
    return out


def read_options(out):
    """{name: text} of the configuration of a built firmware."""
    lines = (out / "auto.conf").read_text().splitlines()
    return dict(line[len("CONFIG_"):].split("=", 1) for line in lines)


def read_constants(out):
    """Constants of a built firmware's dictionary."""
    return json.loads((out / "klipper.dict").read_text())["config"]


def read_sizes(prefix, elf):
    """(flash, memory) bytes of a program."""
    text = subprocess.run([prefix + "size", str(elf)], check=True,
                          capture_output=True, text=True).stdout
    code, data, bss = (int(w) for w in text.splitlines()[1].split()[:3])
    return code + data, data + bss
