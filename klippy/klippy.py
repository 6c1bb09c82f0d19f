# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon by its path: `python klippy/klippy.py printer.cfg ...`."""

import pathlib
import sys

if __name__ == "__main__":
    # This folder must not be searched: its files are modules of a package.
    here = pathlib.Path(__file__).resolve().parent
    sys.path[:] = [path for path in sys.path
                   if not path or pathlib.Path(path).resolve() != here]
    sys.path.insert(0, str(here.parent))

from klippy.printer import Printer  # noqa: E402

__all__ = ["Printer", "main"]


def main(argv=None):
    """Run a command line; returns the exit status."""
    from klippy import cli
    return cli.main(argv)


if __name__ == "__main__":
    sys.exit(main())
