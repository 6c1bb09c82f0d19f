# SPDX-License-Identifier: GPL-3.0-or-later
"""Host software of the printer: plans motion and drives micro-controllers.

With KLIPPY_PURE=1 in the environment the .py of a module wins over its
compiled form.  See klippy/plugins.py for the other way to import it all.
"""

import importlib
import os

if os.environ.get("KLIPPY_PURE") == "1":
    from klippy import pureimport

    pureimport.install()


def __getattr__(name):
    """`klippy.Printer`, for plug-ins."""
    if name == "Printer":
        return importlib.import_module("klippy.printer").Printer
    raise AttributeError("module 'klippy' has no attribute '%s'" % (name,))
