# SPDX-License-Identifier: GPL-3.0-or-later
import pathlib
import sys

UNIT = pathlib.Path(__file__).resolve().parents[1]
for folder in (UNIT, UNIT / "simulator", UNIT / "extras" / "home"):
    sys.path.insert(0, str(folder))
