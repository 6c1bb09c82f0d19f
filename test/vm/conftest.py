# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers of the firmware's tests are ours too."""

import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "firmware"))
