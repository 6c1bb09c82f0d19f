# SPDX-License-Identifier: GPL-3.0-or-later
"""Boot loaders on USB that speak DFU, or ST's DfuSe: by dfu-util.

What DfuSe has written is read back and compared.  A chip that leaves its boot
loader may be gone before dfu-util has its answer, of which dfu-util makes an error:
what was read back, or the state it has told before, counts more.
Source: USB's Device Firmware Upgrade 1.1; ST's notes AN3156 and UM0391.
"""

import pathlib
import re
import tempfile

from klippy.errors import PrinterError
from klippy.flash import tools

USB_ID = re.compile(r"[0-9a-fA-F]{4}:[0-9a-fA-F]{4}$")
MAPLE_ID = "1eaf:0003"
MAPLE_FLASH = "2"               # its setting for flash behind the boot loader
# All was written, and the reset that starts it is to come
MAPLE_WRITTEN = "dfuMANIFEST-WAIT-RESET, status(0)"


def is_id(device):
    """True for vendor:product of USB."""
    return bool(USB_ID.match(device))


def write(target, device):
    """Write the firmware of a Target to a USB id."""
    image = target.find_file(".bin")
    if device.lower() == MAPLE_ID:
        _write_maple(device, image)
    elif target.family == "stm32":
        _write_dfuse(device, image, target.read_number("FLASH_APPLICATION_ADDRESS",
                                                       0x8000000))
    else:
        tools.run_tool(["dfu-util", "-d", device, "-D", image])


def _write_maple(device, image):
    status, told = tools.listen_to_tool(
        ["dfu-util", "-d", device, "-a", MAPLE_FLASH, "-D", image])
    if MAPLE_WRITTEN not in told:
        tools.check_status("dfu-util", status)


def _write_dfuse(device, image, start):
    command = ["dfu-util", "-d", device, "-a", "0"]
    tools.run_tool([*command, "-s", "0x%x" % (start,), "-D", image])
    expected = image.read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        back = pathlib.Path(folder, "read.bin")
        status = tools.try_tool([*command, "-s", "0x%x:%d:leave"
                                 % (start, len(expected)), "-U", back])
        found = back.read_bytes() if back.exists() else b""
    _compare(expected, found, start, status)
    print("  read back: %d bytes are the same" % (len(expected),))


def _compare(expected, found, start, status):
    """PrinterError unless both are the same."""
    if found == expected:
        return
    if len(found) < len(expected):
        raise PrinterError(
            "The firmware was written, but could not be read back (dfu-util has exit"
            " status %d): reset the board to see whether it works" % (status,))
    wrong = [i for i in range(len(expected)) if expected[i] != found[i]]
    raise PrinterError(
        "What was read back differs in %d of %d bytes, the first at 0x%x: flash it"
        " again, and if that is the same each time, the chip's flash is worn out"
        % (len(wrong), len(expected), start + wrong[0]))
