# SPDX-License-Identifier: GPL-3.0-or-later
"""UF2 images: what the boot loaders that show a drive take."""

import pathlib
import struct

from klippy.errors import PrinterError

MAGIC_START = (0x0A324655, 0x9E5D5157)
MAGIC_END = 0x0AB16F30
FLAG_FAMILY = 0x2000
FAMILIES = {"rp2040": 0xE48BFF56, "rp2350": 0xE48BFF59}
PAYLOAD = 256
DATA_SIZE = 476
INFO_FILE = "INFO_UF2.TXT"


def convert(data, address, family):
    """UF2 blocks of a binary that belongs at an address; family: a number."""
    count = (len(data) + PAYLOAD - 1) // PAYLOAD
    blocks = []
    for i in range(count):
        part = data[i * PAYLOAD:(i + 1) * PAYLOAD].ljust(PAYLOAD, b"\0")
        blocks.append(struct.pack(
            "<8I%dsI" % (DATA_SIZE,), *MAGIC_START, FLAG_FAMILY,
            address + i * PAYLOAD, PAYLOAD, i, count, family,
            part.ljust(DATA_SIZE, b"\0"), MAGIC_END))
    return b"".join(blocks)


def find_drives(root="/"):
    """Folders of mounted drives that take UF2 files."""
    found = []
    for line in _read_mounts(root):
        folder = pathlib.Path(line.replace("\\040", " "))
        if (folder / INFO_FILE).exists():
            found.append(folder)
    return found


def _read_mounts(root):
    path = pathlib.Path(root) / "proc/mounts"
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    return [line.split()[1] for line in lines if len(line.split()) > 1]


def write(target, drive=None, root="/"):
    """Copy the firmware of a Target to a drive, or to the only one there is."""
    name = "rp2350" if target.mcu.lower().startswith("rp235") else "rp2040"
    drives = [pathlib.Path(drive)] if drive else find_drives(root)
    if len(drives) != 1:
        raise PrinterError(
            "%s: hold BOOTSEL while you attach the board, mount its drive, and try"
            " again, or name its folder with FLASH_DEVICE=" % (
                "Several drives take UF2 files" if drives
                else "No drive that takes UF2 files is mounted",))
    ready = target.folder / "klipper.uf2"
    data = ready.read_bytes() if ready.exists() else convert(
        target.find_file(".bin").read_bytes(),
        target.read_number("FLASH_APPLICATION_ADDRESS", 0x10000000), FAMILIES[name])
    place = drives[0] / "klipper.uf2"
    place.write_bytes(data)
    print("  %s: %d bytes" % (place, len(data)))
