# SPDX-License-Identifier: GPL-3.0-or-later
"""The checksum of vectors that the boot ROM of an LPC176x looks at."""

import importlib.util
import pathlib
import struct

PATH = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "lpc_checksum.py"


def test_first_eight_vectors_add_up_to_nothing():
    spec = importlib.util.spec_from_file_location("lpc_checksum", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    image = struct.pack("<9I", 0x10007FE0, 0x40D5, *[0xFFFFFF01] * 5, 77, 0x1234)
    out = module.add_checksum(image)
    words = struct.unpack("<9I", out)
    assert sum(words[:8]) % 2**32 == 0
    assert words[:7] == struct.unpack("<7I", image[:28]) and words[8] == 0x1234
