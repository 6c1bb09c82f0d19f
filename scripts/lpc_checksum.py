# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the first eight vectors of an LPC176x image add up to 0.

usage: lpc_checksum.py IMAGE
The boot ROM starts no program without that (UM10360, 32.3.1.1); the word that
makes it so is vector 7.
"""

import pathlib
import struct
import sys

N_SUMMED = 7


def add_checksum(image):
    """The image (bytes) with its vector 7 set."""
    words = struct.unpack_from("<%dI" % (N_SUMMED,), image)
    out = bytearray(image)
    struct.pack_into("<I", out, 4 * N_SUMMED, -sum(words) & 0xFFFFFFFF)
    return bytes(out)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    path = pathlib.Path(sys.argv[1])
    path.write_bytes(add_checksum(path.read_bytes()))
