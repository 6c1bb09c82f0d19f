# SPDX-License-Identifier: GPL-3.0-or-later
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent))
