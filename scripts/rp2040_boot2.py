#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Second boot stage of an RP2040 with its checksum, as an assembler source.

    rp2040_boot2.py boot2.bin boot2_sum.S
"""

import pathlib
import struct
import sys

SIZE = 256
POLYNOMIAL = 0x04C11DB7


def checksum(data):
    """CRC-32 as the boot ROM has it: not reflected, from all ones, not inverted
    (RP2040 data sheet, 2.8.1.3.1)."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = crc << 1 ^ (POLYNOMIAL if crc & 0x80000000 else 0)
        crc &= 0xFFFFFFFF
    return crc


def complete(code):
    """256 bytes of code, zeros and checksum."""
    if len(code) > SIZE - 4:
        raise SystemExit("The second boot stage takes %d bytes of %d"
                         % (len(code), SIZE - 4))
    code = code.ljust(SIZE - 4, b"\0")
    return code + struct.pack("<I", checksum(code))


def main(source, place):
    image = complete(pathlib.Path(source).read_bytes())
    words = struct.unpack("<%dI" % (SIZE // 4,), image)
    text = '.section .boot2, "a"\n' + "".join(".word 0x%08x\n" % w for w in words)
    pathlib.Path(place).write_text(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
