# SPDX-License-Identifier: GPL-3.0-or-later
"""Drives that boot loaders on USB show: found in /sys, mounted, known to be gone.

A drive that leaves is not seen in its folder, which the kernel has cached: its
block device is what counts.
"""

import contextlib
import dataclasses
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

from klippy.errors import PrinterError
from klippy.flash import devices, touch

INFO_FILE = "INFO_UF2.TXT"
AUTOMOUNT_WAIT = 4.0            # s that a desktop may take


@dataclasses.dataclass
class Drive:
    """A mounted drive: its folder, and its block device if that is known."""

    folder: pathlib.Path
    block: str = ""
    is_ours: bool = False       # mounted here

    def read_info(self):
        """What the boot loader tells about itself; "" if it has gone."""
        try:
            return (self.folder / INFO_FILE).read_text(errors="replace")
        except OSError:
            return ""

    def has_gone(self, root="/"):
        """True once the boot loader has left."""
        if self.block:
            return not (pathlib.Path(root) / self.block.lstrip("/")).exists()
        return not self.read_info()

    def release(self):
        """Take a mount of ours back; the drive may have gone before."""
        if self.is_ours:
            subprocess.run(["umount", "-l", str(self.folder)], check=False,
                           capture_output=True)
            with contextlib.suppress(OSError):
                self.folder.rmdir()


def list_mounts(root="/"):
    """[(block device, folder)] of what is mounted."""
    try:
        text = (pathlib.Path(root) / "proc/mounts").read_text(encoding="utf-8")
    except OSError:
        return []
    words = [line.split() for line in text.splitlines()]
    return [(line[0], pathlib.Path(_decode(line[1]))) for line in words
            if len(line) > 1]


def _decode(text):
    """A path of /proc/mounts, where blanks and others are octal."""
    return re.sub(r"\\([0-7]{3})", lambda m: chr(int(m.group(1), 8)), text)


def find_drives(root="/"):
    """Mounted Drives that take UF2 files."""
    drives = [Drive(folder, block) for block, folder in list_mounts(root)]
    return [d for d in drives if d.read_info()]


def find_drive(folder, root="/"):
    """The Drive in a folder that somebody names; PrinterError if it takes no UF2."""
    folder = pathlib.Path(folder)
    blocks = {str(place): block for block, place in list_mounts(root)}
    drive = Drive(folder, blocks.get(os.path.realpath(folder), ""))
    if not drive.read_info():
        raise PrinterError(
            "'%s' is not the drive of a boot loader: it has no %s. Hold BOOTSEL while"
            " you attach the board, and mount the drive that it shows"
            % (folder, INFO_FILE))
    return drive


def list_blocks(usb_id, root="/"):
    """Block devices of all USB devices of an id: their first partitions, or whole
    drives without."""
    found = []
    for folder in devices.find_folders(usb_id, root):
        for disk in sorted(folder.glob(folder.name + ":*/host*/target*/*/block/*")):
            parts = sorted(p.name for p in disk.glob(disk.name + "*"))
            found.append("/dev/" + (parts or [disk.name])[0])
    return found


def wait_for_drive(usb_id, root="/"):
    """The Drive of a boot loader that is on USB: mounted by the desktop, or here."""
    blocks = touch.poll(lambda: list_blocks(usb_id, root))
    if not blocks:
        raise PrinterError("The boot loader %s shows no drive: is the kernel's module"
                           " usb_storage there?" % (usb_id,))
    if len(blocks) > 1:
        raise PrinterError(
            "Several boards are in their boot loader: mount the drive of one, and name"
            " its folder: FLASH_DEVICE=FOLDER\n    " + "\n    ".join(blocks))
    block, = blocks
    touch.poll(lambda: (pathlib.Path(root) / block[1:]).exists())
    folder = touch.poll(lambda: _find_folder(block, root), AUTOMOUNT_WAIT)
    return Drive(folder, block) if folder else _mount(block, root)


def _find_folder(block, root):
    return next((place for name, place in list_mounts(root) if name == block), None)


def _mount(block, root):
    if os.geteuid() == 0:
        folder = tempfile.mkdtemp(prefix="klippy-")
        error = _run("mount", "-t", "vfat", block, folder)
        if not error:
            return Drive(pathlib.Path(folder), block, True)
        os.rmdir(folder)
    else:
        error = _run("udisksctl", "mount", "--no-user-interaction", "-b", block)
        folder = _find_folder(block, root)
        if folder:
            return Drive(folder, block)
    raise PrinterError(
        "The drive %s of the boot loader cannot be mounted (%s): try 'sudo make flash',"
        " or mount it and name its folder with FLASH_DEVICE=" % (block, error))


def _run(name, *args):
    """What a program says of its failure; "" if it succeeds."""
    if not shutil.which(name):
        return "there is no %s" % (name,)
    result = subprocess.run([name, *args], capture_output=True, text=True, check=False)
    return "" if not result.returncode else (
        result.stderr.strip() or "%s ends with %d" % (name, result.returncode))
