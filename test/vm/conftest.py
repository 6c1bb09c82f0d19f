# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers of the firmware's and the emulators' tests are ours too."""

import pathlib
import sys

for name in ("firmware", "emulator"):
    sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / name))
