# SPDX-License-Identifier: GPL-3.0-or-later
"""UF2 images: what the boot loaders that show a drive take."""

import struct

MAGIC_START = (0x0A324655, 0x9E5D5157)
MAGIC_END = 0x0AB16F30
FLAG_FAMILY = 0x2000
FAMILIES = {"rp2040": 0xE48BFF56, "rp2350": 0xE48BFF59}
PAYLOAD = 256
DATA_SIZE = 476


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
