# SPDX-License-Identifier: GPL-3.0-or-later
"""Every configuration of test/configs builds, without warnings, and fits; no
interrupt divides in software."""

import firmware_matrix
import irq_division
import pytest


def check_cores(prefix, out):
    """The PRU's cores have a program each, which the linker fits in; there is no
    function that divides, so that one which needs it is not linked."""
    for core in ("pru0", "pru1"):
        flash, memory = firmware_matrix.read_sizes(prefix, out / (core + ".elf"))
        print("%-12s %6d bytes of code and constants, %6d of memory"
              % (core, flash, memory))


@pytest.mark.parametrize("name", firmware_matrix.CONFIGS)
def test_configuration_builds(name):
    prefix = firmware_matrix.find_prefix(name)
    if prefix is None:
        pytest.skip(firmware_matrix.say_missing(name))
    out = firmware_matrix.build(name)
    options = firmware_matrix.read_options(out)
    constants = firmware_matrix.read_constants(out)
    assert constants["CLOCK_FREQ"] == int(options["CLOCK_FREQ"])
    if not (out / "klipper.elf").exists():
        check_cores(prefix, out)
        return
    flash, memory = firmware_matrix.read_sizes(prefix, out / "klipper.elf")
    print("%-12s %6d bytes of flash, %6d of memory" % (name, flash, memory))
    if "FLASH_SIZE" in options and options["FLASH_SIZE"] != "0":
        start = int(options.get("FLASH_APPLICATION_ADDRESS", "0"), 0)
        base = int(options.get("FLASH_BASE", "0"), 0)
        room = base + int(options["FLASH_SIZE"], 0) - start
        assert flash <= room
        assert memory + int(options["STACK_SIZE"]) < int(options["RAM_SIZE"], 0)
    if prefix:
        assert irq_division.find_divisions(prefix, out / "klipper.elf") == []
