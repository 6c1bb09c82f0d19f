# SPDX-License-Identifier: GPL-3.0-or-later
"""Printers on firmware that really was built without features.

What test_lacking_firmware removes from dictionaries is left out of the build here.
"""
import firmware_matrix
import pytest
from firmware_matrix import ROOT
from machine_configs import BED, make_axes
from printer_run import PrinterRun
from test_lacking_firmware import BEARABLE, JOB, check_out_of_use, get_status

from klippy.errors import PrinterError

BUILDS = {"lights": ("WANT_NEOPIXEL", "WANT_SOFTWARE_SPI", "WANT_SOFTWARE_I2C"),
          "inputs": ("WANT_BUTTONS", "WANT_PULSE_COUNTER", "WANT_I2C")}


def build(name, options):
    """Path of a simulator's firmware without some options."""
    out = firmware_matrix.build("simulator", tuple("%s=n" % o for o in options),
                                ROOT / "out" / "matrix" / ("simulator_" + name))
    return out / "klipper.so"


def make_config(library, sections):
    text = make_axes("cartesian", extra=BED + sections)
    # free pins of the one board
    for old, new in (("aux:PA2", "PF0"), ("aux:PA3", "PF1"), ("aux:PA4", "PF2"),
                     ("aux:PA5", "PF3"), ("aux:PA6", "PG3"), ("aux:PA0", "PG0"),
                     ("aux:PA1", "PG1"), ("i2c_mcu: aux", "i2c_mcu: mcu")):
        text = text.replace(old, new)
    return text + "[simulator]\nfirmware: %s\n" % (library,)


@pytest.mark.slow
@pytest.mark.parametrize("name, option", [(name, option) for name, options in
                                          BUILDS.items() for option in options])
def test_prints_without(tmp_path, name, option):
    sections, commands, statuses = BEARABLE[option]

    def look(printer):
        check_out_of_use(printer, commands, option, statuses)
        assert any(option in warning["message"] for warning in
                   get_status(printer, "configfile")["warnings"])
    library = build(name, BUILDS[name])
    PrinterRun(make_config(library, sections), tmp_path).run([look, JOB])


@pytest.mark.slow
def test_does_not_heat_without_inputs(tmp_path):
    library = build("cold", ("WANT_ADC",))
    with pytest.raises(PrinterError, match=r"(?s)without \[heater_bed\] at .*"
                       r"WANT_ADC.*without \[extruder\] at .*WANT_ADC"):
        PrinterRun(make_config(library, ""), tmp_path).run([])
