# SPDX-License-Identifier: GPL-3.0-or-later
"""Emulated chips are judged with the model of the end-to-end tests."""

import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "klippy"))
