# SPDX-License-Identifier: GPL-3.0-or-later
"""Host software of the printer: plans motion and drives micro-controllers.

With KLIPPY_PURE=1 in the environment the .py of a module wins over its
compiled form.  See klippy/plugins.py for the other way to import it all.
"""

import os

if os.environ.get("KLIPPY_PURE") == "1":
    from klippy import pureimport

    pureimport.install()
