# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs a wheel so that the same files always give the same bytes."""

import time
import zipfile

# The directory of the wheel comes last, as the format asks for
INFO = ".dist-info/"


def normalize(wheel, seconds, target):
    """Write a wheel anew: files in order, one time, modes without a umask."""
    date = time.gmtime(max(seconds, 315532800))[:6]
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(target, "w") as new:
        infos = [info for info in old.infolist() if not info.is_dir()]
        for info in sorted(infos, key=lambda i: (INFO in i.filename, i.filename)):
            mode = 0o755 if info.external_attr >> 16 & 0o111 else 0o644
            entry = zipfile.ZipInfo(info.filename, date)
            entry.external_attr = (0o100000 | mode) << 16
            entry.create_system = 3     # Unix, whoever packs it
            entry.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(entry, old.read(info), compresslevel=9)
