# SPDX-License-Identifier: GPL-3.0-or-later
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
UNIT = HERE.parents[1]
for folder in (UNIT, UNIT / "simulator", HERE.parent / "home", HERE):
    sys.path.insert(0, str(folder))
