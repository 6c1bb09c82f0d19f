# SPDX-License-Identifier: GPL-3.0-or-later
"""Programs of others that write to boards: found, or named with their package."""

import os
import shlex
import shutil
import subprocess

from klippy.errors import PrinterError

PACKAGES = {"avrdude": "avrdude", "stm32flash": "stm32flash",
            "dfu-util": "dfu-util", "bossac": "bossa-cli"}


def find_tool(name):
    """Path of a program; PrinterError tells how to install it."""
    path = shutil.which(name)
    if path is None:
        raise PrinterError("The program '%s' is missing:\n    sudo apt-get install %s"
                           % (name, PACKAGES.get(name, name)))
    return path


def run_tool(command):
    """Run [program, arguments ...] with its output shown; PrinterError if it
    fails.  More arguments come from the environment's FLASH_ARGS."""
    more = shlex.split(os.environ.get("FLASH_ARGS", ""))
    line = [find_tool(command[0]), *more, *[str(word) for word in command[1:]]]
    print("  " + " ".join([command[0], *line[1:]]), flush=True)
    status = subprocess.run(line, check=False).returncode
    if status:
        raise PrinterError("'%s' failed (exit status %d): what it wrote above tells"
                           " why" % (command[0], status))
