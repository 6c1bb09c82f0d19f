# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m klippy`: the command line."""

import sys

from klippy.cli import main

if __name__ == "__main__":
    sys.exit(main())
