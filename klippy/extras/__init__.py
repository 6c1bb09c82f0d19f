# SPDX-License-Identifier: GPL-3.0-or-later
"""Features, each loaded by the name of its config section.

The files are grouped in folders but share one flat namespace; a file that lies
directly in this folder wins over a grouped one of the same name.
"""

import os

GROUPS = (
    "boards", "printing", "heating", "filament", "system", "sampling",
    "thermometry", "panels", "motion", "drivers", "outputs", "probing",
    "vibration", "home", "leveling", "cooling", "lights")

BUILTIN_PATHS = [os.path.join(os.path.dirname(__file__), group) for group in GROUPS]
__path__.extend(path for path in BUILTIN_PATHS if path not in __path__)
