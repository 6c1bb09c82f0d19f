# SPDX-License-Identifier: GPL-3.0-or-later
"""The host on a kernel's USB: flashing by a drive, printing by a serial port."""

import machine
import pytest
from linux_board import build_linux

pytestmark = [pytest.mark.slow,
              pytest.mark.skipif(bool(machine.why_not()), reason=machine.why_not())]
MODULES = ("dummy_hcd", "usb_storage", "sd_mod", "vfat", "nls_cp437", "nls_ascii",
           "nls_iso8859_1", "nls_utf8", "configfs", "usb_f_mass_storage", "usb_f_acm",
           "cdc_acm")


def test_rp2040_from_rom_to_print(tmp_path):
    output = machine.run(tmp_path, MODULES, "usb_host.py", build_linux())
    done = [line[3:] for line in output.splitlines() if line.startswith("ok ")]
    assert done == ["listed", "flashed", "ready", "printed", "stopped"]
