# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the sample printers and jobs lie: in the wheel or in the checkout."""
import pathlib

from klippy.errors import PrinterError

HERE = pathlib.Path(__file__).resolve()
PACKAGE_FOLDER = HERE.parent / "samples"
CHECKOUT_FOLDER = HERE.parents[2] / "config"


def find_sample(name):
    """Path of a file like 'sample-cartesian.cfg' or 'samples/cube20.gcode'."""
    for folder in (CHECKOUT_FOLDER, PACKAGE_FOLDER):
        path = folder / name
        if path.is_file():
            return str(path)
    raise PrinterError("The sample '%s' is neither in %s nor in %s"
                       % (name, CHECKOUT_FOLDER, PACKAGE_FOLDER))
