# SPDX-License-Identifier: GPL-3.0-or-later
"""Boards that are attached: serial ports, and USB devices in a boot loader."""

import dataclasses
import pathlib

from klippy.errors import PrinterError

# USB ids of boot loaders: family they belong to, what they are
BOOT_LOADERS = {
    "0483:df11": ("stm32", "STM32 boot loader (DFU)"),
    "1eaf:0003": ("stm32", "stm32duino boot loader (DFU)"),
    "1d50:6015": ("lpc176x", "Smoothieware boot loader (DFU)"),
    "03eb:6124": ("atsam", "SAM-BA boot loader"),
    "2e8a:0003": ("rp2040", "RP2040 boot loader (drive)"),
    "2e8a:000f": ("rp2040", "RP2350 boot loader (drive)"),
}
# Words in the names under /dev/serial/by-id that tell a family
SERIAL_NAMES = {
    "avr": ("arduino", "atmega", "at90usb", "1a86", "ftdi", "wch", "teensy"),
    "stm32": ("stm32", "1a86", "ftdi", "silicon_labs", "prolific", "wch"),
    "lpc176x": ("lpc17",), "atsam": ("sam3", "sam4", "same70", "arduino_due"),
    "atsamd": ("samd", "samc", "same5"), "rp2040": ("rp2040", "rp2350", "pico"),
}


@dataclasses.dataclass
class Device:
    """Something to write to: a path of a serial port, or a USB id."""

    path: str
    name: str
    family: str = ""            # of a boot loader


def _read(path):
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


def _read_id(folder):
    """Vendor and product of a USB device, as its id."""
    return "%s:%s" % (_read(folder / "idVendor"), _read(folder / "idProduct"))


def list_serial(root="/"):
    """Serial ports, by the names that do not change."""
    dev = pathlib.Path(root) / "dev"
    found, seen = [], set()
    for link in sorted(dev.glob("serial/by-id/*")):
        seen.add(link.resolve().name)
        found.append(Device(str(link), link.name))
    for pattern in ("ttyACM*", "ttyUSB*"):
        for port in sorted(dev.glob(pattern)):
            if port.name not in seen:
                found.append(Device(str(port), port.name))
    return found


def list_boot_loaders(root="/"):
    """USB devices that wait for firmware."""
    found = []
    for folder in sorted(pathlib.Path(root).glob("sys/bus/usb/devices/*")):
        usb_id = _read_id(folder)
        if usb_id in BOOT_LOADERS:
            family, name = BOOT_LOADERS[usb_id]
            found.append(Device(usb_id, name, family))
    return found


def find_folders(usb_id, root="/"):
    """Folders in /sys of all USB devices of an id."""
    folders = sorted(pathlib.Path(root).glob("sys/bus/usb/devices/*"))
    return [folder for folder in folders if _read_id(folder) == usb_id]


def find_port(usb_id, root="/"):
    """Serial port of a USB device: a path, "" without."""
    for folder in find_folders(usb_id, root):
        for port in sorted(folder.parent.glob(folder.name + ":*/tty/*")):
            return str(pathlib.Path(root) / "dev" / port.name)
    return ""


def list_all(root="/"):
    """Every Device that could be written to."""
    return list_boot_loaders(root) + list_serial(root)


def list_candidates(family, mcu="", root="/"):
    """Devices for a chip, the likeliest kind only: in its boot loader, named
    after the chip, named like its family, any serial port."""
    loaders = [d for d in list_boot_loaders(root) if d.family == family]
    ports = list_serial(root)
    chip = [d for d in ports if mcu and mcu.lower()[:9] in d.name.lower()]
    words = SERIAL_NAMES.get(family, ())
    like = [d for d in ports if any(word in d.name.lower() for word in words)]
    return next((kind for kind in (loaders, chip, like, ports) if kind), [])


def describe(devices):
    """Lines that list devices for a message."""
    return "\n".join("    FLASH_DEVICE=%s    (%s)" % (d.path, d.name) for d in devices)


def choose(family, mcu="", root="/"):
    """The one Device for a chip; PrinterError lists them if there are more."""
    found = list_candidates(family, mcu, root)
    if len(found) == 1:
        return found[0]
    if found:
        raise PrinterError("Several devices may be the %s: choose one\n%s"
                           % (mcu or family, describe(found)))
    raise PrinterError(
        "No board found for %s: neither a serial port nor a boot loader on USB."
        " Attach it, or name it: FLASH_DEVICE=/dev/ttyUSB0" % (mcu or family,))
