# SPDX-License-Identifier: GPL-3.0-or-later
"""Asking running firmware for its boot loader: the 1200 baud touch."""

import contextlib
import os
from time import sleep

import serial

from klippy.errors import PrinterError
from klippy.flash import devices

TOUCH_BAUD = 1200
WAIT = 10.0
PERIOD = 0.1


def touch(path):
    """Open and close a USB serial port at 1200 baud: its board starts the boot
    loader."""
    try:
        port = serial.Serial(path, TOUCH_BAUD, exclusive=False)
        with contextlib.suppress(OSError):  # the port may have no such line
            port.dtr = False
        port.close()
    except (OSError, serial.SerialException) as err:
        raise PrinterError("Cannot open '%s': %s" % (path, err)) from None


def poll(find, wait=WAIT):
    """What find() returns as soon as that is true; else, after `wait` seconds, what
    it returns last."""
    for _ in range(int(wait / PERIOD)):
        found = find()
        if found:
            return found
        sleep(PERIOD)
    return find()


def wait_for_port(usb_id, root="/"):
    """Path of the serial port of a USB device that is there or about to come;
    PrinterError after WAIT."""
    port = poll(lambda: devices.find_port(usb_id, root))
    if port and poll(lambda: os.path.exists(port)):
        return port
    raise PrinterError("The boot loader %s has no serial port: is the kernel's module"
                       " cdc_acm there?" % (usb_id,))


def wait_for_change(before, family, root="/"):
    """The Device that has come since `before` (list of Device); PrinterError
    after WAIT.  What went away and came back counts as well."""
    known = {d.path for d in before}
    seen = set()
    for _ in range(int(WAIT / PERIOD)):
        now = devices.list_all(root)
        new = [d for d in now if d.path not in known
               and d.family in ("", family)]
        # seen twice: names come and go one after the other
        lasting = [d for d in new if d.path in seen]
        if lasting:
            return lasting[0]
        seen = {d.path for d in new}
        known &= {d.path for d in now}
        sleep(PERIOD)
    raise PrinterError(
        "The board did not start its boot loader within %.0f s: press its reset"
        " button (twice, if it has one for two purposes) and try again" % (WAIT,))
