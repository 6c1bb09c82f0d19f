# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon by its path: `python klippy/klippy.py printer.cfg ...`."""

import gc
import os
import sys

if __name__ == "__main__":
    gc.disable()        # until all is imported: see klippy.cli.find_command()
    # This folder must not be searched: its files are modules of a package.
    here = os.path.dirname(os.path.realpath(__file__))
    sys.path[:] = [path for path in sys.path
                   if not path or os.path.realpath(path) != here]
    sys.path.insert(0, os.path.dirname(here))

from klippy.printer import Printer  # noqa: E402

__all__ = ["Printer", "main"]


def main(argv=None):
    """Run a command line; returns the exit status."""
    from klippy import cli
    return cli.main(argv)


if __name__ == "__main__":
    sys.exit(main())
