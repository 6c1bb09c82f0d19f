# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the simulator's firmware lies: in the wheel or in the build folder."""
import os
import pathlib

from klippy.errors import ConfigError

LIBRARY = "klipper.so"
PACKAGE_FOLDER = pathlib.Path(__file__).resolve().parent / "firmware"
PROJECT_FOLDER = pathlib.Path(__file__).resolve().parents[2]
BUILD_FOLDERS = (PROJECT_FOLDER / "out-simulator",
                 PROJECT_FOLDER / "out" / "simulator", PROJECT_FOLDER / "out")


def find_firmware(wanted=None):
    """Path of the shared object; ConfigError tells how to make it.

    wanted: path from the [simulator] section, looked at first.
    """
    if wanted is not None:
        path = os.path.expanduser(wanted)
        if os.path.isfile(path):
            return path
        raise ConfigError("Option 'firmware' in section 'simulator': there is"
                          " no file '%s'" % (wanted,))
    for folder in (PACKAGE_FOLDER, *BUILD_FOLDERS):
        path = folder / LIBRARY
        if path.is_file():
            return str(path)
    raise ConfigError(
        "The simulator's firmware %s is neither in %s nor in %s: run"
        " 'make simulator' in the project's folder"
        % (LIBRARY, PACKAGE_FOLDER, BUILD_FOLDERS[0]))
