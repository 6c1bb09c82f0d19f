#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""UF2 image of a built firmware: make_uf2.py OUT_FOLDER klipper.uf2"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from klippy.flash import uf2  # noqa: E402


def main(folder, place):
    folder = pathlib.Path(folder)
    lines = (folder / "auto.conf").read_text(encoding="utf-8").splitlines()
    options = dict(line.split("=", 1) for line in lines if "=" in line)
    start = int(options["CONFIG_FLASH_APPLICATION_ADDRESS"], 16)
    if options.get("CONFIG_RP2040_BOOT2") == "y":
        start = int(options["CONFIG_FLASH_BASE"], 16)
    family = uf2.FAMILIES[options["CONFIG_MCU"].strip('"')]
    data = (folder / "klipper.bin").read_bytes()
    pathlib.Path(place).write_bytes(uf2.convert(data, start, family))


if __name__ == "__main__":
    main(*sys.argv[1:])
