# SPDX-License-Identifier: GPL-3.0-or-later
"""Other people's clients, each in a virtual environment outside the tree.

    python packages.py          install all; says plainly which it could not
"""

import os
import pathlib
import subprocess
import sys

REQUIREMENTS = {"moonraker": "moonraker~=0.11.0", "octoprint": "OctoPrint~=1.11.0"}
INSTALL_TIMEOUT = 900


def find_cache():
    """The folder that holds the environments."""
    folder = os.environ.get("KLIPPY_CLIENTS")
    if folder:
        return pathlib.Path(folder)
    cache = os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache"
    return pathlib.Path(cache) / "klippy-clients"


def find_python(name):
    """The interpreter of an installed client, None if there is none."""
    folder = find_cache() / name
    python = folder / "bin" / "python"
    is_complete = any(folder.glob("lib/python*/site-packages/%s/__main__.py" % (name,)))
    return python if is_complete and python.exists() else None


def install(name):
    """Install a client; returns None, or why it cannot be installed."""
    if find_python(name) is not None:
        return None
    folder = find_cache() / name
    try:
        for command in (
                [sys.executable, "-m", "venv", str(folder)],
                [str(folder / "bin" / "pip"), "-q", "--disable-pip-version-check",
                 "install", REQUIREMENTS[name]]):
            subprocess.run(command, check=True, capture_output=True, text=True,
                           timeout=INSTALL_TIMEOUT)
    except subprocess.CalledProcessError as err:
        lines = (err.stderr or err.stdout).strip().splitlines()
        return next((line for line in reversed(lines) if "ERROR" in line),
                    lines[-1] if lines else str(err))
    except (OSError, subprocess.SubprocessError) as err:
        return str(err)
    return None if find_python(name) else "it came without its program"


def main():
    """Install all clients; the tests of those that are missing are skipped."""
    for name in REQUIREMENTS:
        reason = install(name)
        if reason is not None:
            print("no %s here, its tests are skipped: %s" % (name, reason))


if __name__ == "__main__":
    main()
