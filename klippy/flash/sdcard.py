# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware on an SD card: the file as the board's own boot loader wants it."""

import pathlib
import time

from klippy.errors import PrinterError
from klippy.flash import boards

# MKS Robin boot loaders decode these bytes of the file with a repeated key
ROBIN_RANGE = (320, 31040)
ROBIN_KEY = bytes.fromhex("a3bdad0d4111bb8ddc802dd0d2c49b1e"
                          "26ebe3334a15e40ab3b13c93bbaff73e")


def find_board(name):
    """{option: value} of a board by its name or alias; PrinterError lists all."""
    known = boards.BOARDS.get(boards.ALIASES.get(name, name))
    if known is None:
        names = sorted([*boards.BOARDS, *boards.ALIASES])
        raise PrinterError("Unknown board '%s': it is one of\n    %s"
                           % (name, "\n    ".join(names)))
    return {**boards.DEFAULT, **known}


def encode(data, encoding):
    """The binary as a boot loader takes it."""
    if not encoding:
        return data
    if encoding != "mks-robin":
        raise PrinterError("The encoding '%s' of this board's files is not known here:"
                           " flash it by its serial port instead" % (encoding,))
    start, end = ROBIN_RANGE
    out = bytearray(data)
    for i in range(start, min(end, len(data))):
        out[i] ^= ROBIN_KEY[i % len(ROBIN_KEY)]
    return bytes(out)


def check_chip(target, board):
    """PrinterError if firmware is for another chip than the board has."""
    mcu = target.mcu.lower()
    if not board["mcu"].startswith(mcu.rstrip("x")[:9]):
        raise PrinterError("The board has an %s, the firmware is for '%s': choose the"
                           " chip in 'make menuconfig'" % (board["mcu"], target.mcu))


def choose_name(board, now=None):
    """Name of the file; for some boards one that was not used before."""
    if not board["unique"]:
        return board["file"]
    stamp = time.strftime("%Y%m%d%H%M%S", time.localtime(now))
    return board["file"].replace(".bin", "-%s.bin" % (stamp,))


def write(target, board_name, folder):
    """Put a Target's firmware on the card mounted at `folder`; returns the path."""
    board = find_board(board_name)
    check_chip(target, board)
    folder = pathlib.Path(folder)
    if not folder.is_dir():
        raise PrinterError("'%s' is not the folder of a mounted card" % (folder,))
    data = encode(target.find_file(".bin").read_bytes(), board.get("encoding"))
    done = folder / board["done"]
    if done.exists() and done.name != board["file"]:
        done.unlink()
    path = folder / choose_name(board)
    path.write_bytes(data)
    if path.read_bytes() != data:
        raise PrinterError("'%s' reads back wrong: is the card full or worn?" % (path,))
    print("  %s: %d bytes.  Unmount the card, put it into the board, switch it off"
          " and on; the file is called %s when it was taken."
          % (path, len(data), board["done"]))
    return path
