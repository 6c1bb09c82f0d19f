# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy firmware`: builds firmware, flashes boards, lists what is attached."""

import pathlib
import subprocess
import sys

from klippy.errors import PrinterError
from klippy.flash import devices, methods
from klippy.flash.target import read_target

HELP = "build firmware, flash boards, list what is attached"
ROOT = pathlib.Path(__file__).resolve().parents[2]


def add_arguments(parser):
    """Declare the command line."""
    actions = parser.add_subparsers(dest="action", required=True)
    build = actions.add_parser("build", help="build firmware, like make")
    build.add_argument("--config", default=".config",
                       help="the configuration that menuconfig wrote")
    build.add_argument("--source", default=str(ROOT),
                       help="folder of the source code")
    flash = actions.add_parser("flash", help="write built firmware to a board")
    flash.add_argument("--device", default="", help="serial port, USB id in a boot"
                       " loader, canN:uuid, or folder; default: the one there is")
    flash.add_argument("--board", default="", help="board that takes firmware from"
                       " an SD card (with --device, the folder of the card)")
    flash.add_argument("--baud", type=int, default=0, help="of a serial boot loader")
    for action in (build, flash):
        action.add_argument("--out", default="out", help="folder of built firmware")
    actions.add_parser("list", help="list serial ports and boot loaders")


def build(options):
    """Run make in the source tree; returns its exit status."""
    source = pathlib.Path(options.source)
    if not (source / "src" / "build.mk").exists():
        raise PrinterError(
            "There is no source code of the firmware in '%s': clone the project and"
            " say --source FOLDER" % (source,))
    return subprocess.run(
        ["make", "-C", str(source), "firmware", "PYTHON=" + sys.executable,
         "KCONFIG_CONFIG=" + str(pathlib.Path(options.config).resolve()),
         "OUT=%s/" % (pathlib.Path(options.out).resolve(),)], check=False).returncode


def show_devices():
    """Print a line for each device."""
    found = devices.list_all()
    for device in found:
        print("%-40s %s" % (device.path, device.name))
    if not found:
        print("Nothing is attached: no serial port, no boot loader on USB")


def run(options):
    """Carry out a parsed command line; returns the exit status."""
    try:
        if options.action == "build":
            return build(options)
        if options.action == "list":
            show_devices()
            return 0
        target = read_target(options.out)
        print("Firmware for %s in '%s'" % (target.mcu, options.out))
        methods.flash(target, options.device, options.board, options.baud)
        print("Done")
    except PrinterError as err:
        print("error: %s" % (err,), file=sys.stderr)
        return 1
    return 0
