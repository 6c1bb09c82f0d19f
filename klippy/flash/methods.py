# SPDX-License-Identifier: GPL-3.0-or-later
"""How firmware gets into a board: one way for each kind of chip and device."""

import os
import re
import shutil

from klippy.errors import PrinterError
from klippy.flash import (
    blocks,
    bootsel,
    devices,
    dfu,
    pru,
    sdcard,
    streams,
    tools,
    touch,
)

CAN_ADDRESS = re.compile(r"(can\d+|vcan\d+):([0-9a-fA-F]{12})$")
SAMD_OFFSET = 0x2000


def flash(target, device="", board="", baud=0, root="/"):
    """Write the firmware of a Target.

    device: serial port, USB id in a boot loader, canN:uuid, or the folder of a
    mounted card (with board) or drive; "" finds it.  baud: of a serial boot
    loader, 0 for the usual.  PrinterError tells what is wrong.
    """
    can = CAN_ADDRESS.match(device)
    if board:
        sdcard.write(target, board, device)
    elif can:
        write_blocks(target, streams.CanStream(*can.groups()))
    elif target.family == "linux":
        install_linux(target, device)
    elif target.family == "pru":
        pru.install(target, root)
    elif target.family == "rp2040":
        bootsel.write(target, device, root)
    elif target.family not in METHODS:
        raise PrinterError("Firmware for '%s' is not flashed from here: %s"
                           % (target.family, target.folder))
    else:
        if not device:
            device = devices.choose(target.family, target.mcu, root).path
        METHODS[target.family](target, device, baud, root)


def write_blocks(target, stream):
    """Write by the block protocol of the CAN and USB boot loader."""
    loader = blocks.BootLoader(stream)
    try:
        loader.connect()
        check_start(target, loader)
        print("  boot loader of an %s: firmware at 0x%x" % (loader.mcu, loader.start))
        loader.write(target.find_file(".bin").read_bytes(), show_progress)
        loader.start_firmware()
    finally:
        stream.close()


def check_start(target, loader):
    """PrinterError if the boot loader starts firmware elsewhere or has another
    chip."""
    start = target.read_number("FLASH_APPLICATION_ADDRESS", loader.start)
    if start != loader.start:
        raise PrinterError(
            "The boot loader starts firmware at 0x%x, this one is built for 0x%x:"
            " change 'Bootloader offset' in 'make menuconfig'" % (loader.start, start))
    if loader.mcu and not loader.mcu.lower().startswith(target.mcu.lower()[:9]):
        raise PrinterError("The board has an %s, the firmware is for '%s'"
                           % (loader.mcu, target.mcu))


def show_progress(done, total):
    """One line that counts blocks."""
    print("\r  %d of %d blocks" % (done, total), end="" if done < total else "\n",
          flush=True)


def touch_and_wait(target, device, root):
    """Path of the boot loader that a touch of a USB serial port brings up."""
    before = devices.list_all(root)
    touch.touch(device)
    return touch.wait_for_change(before, target.family, root).path


def flash_avr(target, device, baud, root):
    """avrdude; on native USB with a touch before."""
    protocol = target.options.get("AVRDUDE_PROTOCOL", "arduino")
    if protocol == "avr109":
        device = touch_and_wait(target, device, root)
    command = ["avrdude", "-p", target.mcu, "-c", protocol, "-P", device]
    if baud:
        command += ["-b", baud]
    image = target.find_file(".elf.hex")
    tools.run_tool([*command, "-D", "-U", "flash:w:%s:i" % (image,)])


def flash_stm32(target, device, baud, root):
    """dfu-util for a USB id, stm32flash for a UART, a touch on native USB."""
    if target.has("USBSERIAL") and not dfu.is_id(device):
        device = touch_and_wait(target, device, root)
    if dfu.is_id(device):
        dfu.write(target, device)
    elif target.has("USBSERIAL"):
        write_blocks(target, streams.SerialStream(device))
    else:
        start = "0x%x" % (target.read_number("FLASH_APPLICATION_ADDRESS", 0x8000000),)
        tools.run_tool(["stm32flash", "-b", baud or 57600, "-w",
                        target.find_file(".bin"), "-v", "-S", start, "-g", start,
                        device])


def flash_lpc176x(target, device, baud, root):
    """dfu-util; boards whose boot loader reads an SD card need its name."""
    if not dfu.is_id(device):
        device = touch_and_wait(target, device, root)
    if not dfu.is_id(device):
        raise PrinterError(
            "This board takes firmware from its SD card: mount that and say"
            " 'klippy firmware flash --board NAME --device FOLDER'")
    dfu.write(target, device)


def find_samba(target, device, root):
    """Serial port of a boot loader that speaks SAM-BA: of a USB id, the device
    itself, or what a touch of it brings up."""
    loaders = {d.path for d in devices.list_boot_loaders(root)
               if d.family == target.family}
    ports = {os.path.realpath(devices.find_port(loader, root)) for loader in loaders}
    if not dfu.is_id(device) and os.path.realpath(device) not in ports:
        try:
            device = touch_and_wait(target, device, root)
        except PrinterError:
            if not os.path.exists(device):
                raise
            print("  nothing else came: is '%s' the boot loader already?" % (device,))
    if dfu.is_id(device):
        device = touch.wait_for_port(device, root)
    return device


def flash_sam(target, device, baud, root):
    """bossac, to the serial port of a boot loader."""
    tools.find_tool("bossac")
    device = find_samba(target, device, root)
    command = ["bossac", "-p", device, "-a", "-e", "-w", "-v", "-b", "-R"]
    if target.family == "atsamd":
        offset = target.read_number("FLASH_APPLICATION_ADDRESS", SAMD_OFFSET)
        command = ["bossac", "-p", device, "--offset=0x%x" % (offset,), "-e", "-w",
                   "-v", "-R"]
    tools.run_tool([*command, target.find_file(".bin")])


def install_linux(target, prefix):
    """Copy the process to <prefix>/bin; a running one keeps its own image."""
    place = "%s/bin/klipper_mcu" % (prefix or "/usr/local",)
    fresh = place + ".new"
    try:
        shutil.copy(target.find_file(".elf"), fresh)
        shutil.move(fresh, place)
    except OSError as err:
        raise PrinterError("Cannot install '%s': %s" % (place, err.strerror)) from None
    print("  %s: restart its service: systemctl restart klipper-mcu" % (place,))


METHODS = {"avr": flash_avr, "stm32": flash_stm32, "lpc176x": flash_lpc176x,
           "atsam": flash_sam, "atsamd": flash_sam}
