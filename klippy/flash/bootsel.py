# SPDX-License-Identifier: GPL-3.0-or-later
"""RP2040 and RP2350: a UF2 file for the drive that their ROM shows.

Running firmware is asked for its boot loader first.  The ROM starts the firmware
by itself once it has all of the file.
Source: RP2040 data sheet, 2.8; RP2350 data sheet, 5.5.
"""

import errno
import os

from klippy.errors import PrinterError
from klippy.flash import devices, dfu, drives, touch

IDS = {"rp2040": "2e8a:0003", "rp2350": "2e8a:000f"}
# In the drive's INFO_UF2.TXT
BOARD_IDS = {"rp2040": "RPI-RP2", "rp2350": "RP2350"}
PORT_WAIT = 15.0                # s, for the firmware that was written
# The board goes on without waiting for the last bytes of a file system
GONE = (errno.EIO, errno.ENODEV, errno.ENXIO, errno.ENOENT, errno.EROFS)


def write(target, device="", root="/"):
    """Write the firmware of a Target, and wait until it runs.

    device: folder of the drive, USB id of the boot loader, or serial port of
    running firmware; "" finds it.  PrinterError tells what is wrong.
    """
    image = target.find_file(".uf2").read_bytes()
    drive = _open_drive(target, device, root)
    others = {d.path for d in devices.list_serial(root)}
    try:
        _check_chip(target, drive.read_info())
        _copy(image, drive)
        _wait_until_taken(drive, root)
    finally:
        drive.release()
    if target.has("USBSERIAL"):
        print("  it is back: %s" % (_wait_for_port(others, root),))


def _open_drive(target, device, root):
    if not device:
        device = _find_device(target, root)
    if os.path.isdir(device):
        return drives.find_drive(device, root)
    if not dfu.is_id(device):
        device = _start_loader(target, device, root)
    if device.lower() not in IDS.values():
        raise PrinterError("The USB id '%s' is no boot loader of an %s: that is %s"
                           % (device, target.mcu, IDS[target.mcu]))
    return drives.wait_for_drive(device.lower(), root)


def _find_device(target, root):
    """What is in its boot loader comes first, by its drive if that is mounted."""
    mounted = [d for d in drives.find_drives(root)
               if BOARD_IDS[target.mcu] in d.read_info()]
    if len(mounted) == 1:
        return str(mounted[0].folder)
    if mounted:
        raise PrinterError(
            "Several drives take UF2 files: choose one\n" + "\n".join(
                "    FLASH_DEVICE=%s" % (d.folder,) for d in mounted))
    waiting = {d.path for d in devices.list_boot_loaders(root)}
    for usb_id in (IDS[target.mcu], *IDS.values()):
        if usb_id in waiting:
            return usb_id
    return devices.choose(target.family, target.mcu, root).path


def _start_loader(target, port, root):
    """Touch a serial port; the USB id of what comes."""
    if not os.path.exists(port):
        raise PrinterError(
            "There is no '%s': name a serial port, the folder of a boot loader's drive,"
            " or %s\n%s" % (port, IDS[target.mcu],
                            devices.describe(devices.list_all(root))))
    before = {d.path for d in devices.list_boot_loaders(root)}
    touch.touch(port)
    found = touch.poll(lambda: [d for d in devices.list_boot_loaders(root)
                                if d.family == target.family and d.path not in before])
    if not found:
        raise PrinterError(
            "'%s' did not start its boot loader within %.0f s: hold BOOTSEL while you"
            " attach the board, and try again without FLASH_DEVICE"
            % (port, touch.WAIT))
    return found[0].path


def _check_chip(target, info):
    """PrinterError if the drive belongs to another chip."""
    for mcu, name in BOARD_IDS.items():
        if name in info:
            if mcu != target.mcu:
                raise PrinterError("The board has an %s, the firmware is for '%s'"
                                   % (mcu, target.mcu))
            return
    raise PrinterError("The drive is that of another boot loader than an %s has: %s"
                       % (target.mcu, " ".join(info.split()) or "no word of it"))


def _copy(image, drive):
    place = drive.folder / "klipper.uf2"
    try:
        with open(place, "wb") as file:
            file.write(image)
            file.flush()
            os.fsync(file.fileno())
    except OSError as err:
        if err.errno not in GONE:
            raise PrinterError("Cannot write '%s': %s%s" % (
                place, err.strerror, " (sudo make flash?)"
                if err.errno == errno.EACCES else "")) from None
    print("  %s: %d bytes" % (place, len(image)))


def _wait_until_taken(drive, root):
    if not touch.poll(lambda: drive.has_gone(root)):
        raise PrinterError(
            "The boot loader has not taken the file: it is still there after %.0f s."
            " Attach the board anew with BOOTSEL held, and try again" % (touch.WAIT,))


def _wait_for_port(others, root):
    """Path of the serial port that comes."""
    found = touch.poll(lambda: [d.path for d in devices.list_serial(root)
                                if d.path not in others], PORT_WAIT)
    if not found:
        raise PrinterError(
            "The firmware was written, but its serial port has not come within %.0f s:"
            " press the board's reset button, or attach it anew" % (PORT_WAIT,))
    return found[0]
