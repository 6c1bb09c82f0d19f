# SPDX-License-Identifier: GPL-3.0-or-later
import pathlib
import sys

EXTRAS = pathlib.Path(__file__).resolve().parents[1]
for folder in (EXTRAS, EXTRAS / "home", EXTRAS / "motion",
               EXTRAS.parent / "simulator"):
    sys.path.insert(0, str(folder))
