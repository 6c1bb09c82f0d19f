# SPDX-License-Identifier: GPL-3.0-or-later
import pathlib
import sys

UNIT = pathlib.Path(__file__).resolve().parents[2]
for folder in (UNIT, UNIT / "simulator"):
    sys.path.insert(0, str(folder))
