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


def try_tool(command):
    """Run [program, arguments ...] with its output shown; returns its exit status.
    More arguments come from the environment's FLASH_ARGS."""
    return subprocess.run(_make_line(command), check=False).returncode


def listen_to_tool(command):
    """As try_tool(); returns its exit status and what it told (not its errors)."""
    heard = ""
    with subprocess.Popen(_make_line(command), stdout=subprocess.PIPE) as process:
        while part := process.stdout.read1().decode(errors="replace"):
            print(part, end="", flush=True)
            heard += part
    return process.returncode, heard


def run_tool(command):
    """try_tool(); PrinterError if it fails."""
    check_status(command[0], try_tool(command))


def check_status(name, status):
    """PrinterError if a program ended with another exit status than 0."""
    if status:
        raise PrinterError("'%s' failed (exit status %d): what it wrote above tells"
                           " why" % (name, status))


def _make_line(command):
    more = shlex.split(os.environ.get("FLASH_ARGS", ""))
    line = [find_tool(command[0]), *more, *[str(word) for word in command[1:]]]
    print("  " + " ".join([command[0], *line[1:]]), flush=True)
    return line
