# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs a wheel into a folder of its own and uses it as a user would."""

import os
import pathlib
import shutil
import subprocess
import sys

from building import DIST, BuildError, run
from pythons import find_runner

# Tags of wheels that a glibc of 2.28 takes
PLATFORMS = ("manylinux_2_28", "manylinux_2_24", "manylinux_2_17", "manylinux2014")
IMPORT_ALL = """
import importlib, pathlib, sys
folder = pathlib.Path(sys.argv[1])
names = [p.relative_to(folder) for p in folder.glob("klippy*/**/*.cpython-*.so")]
for name in names:
    importlib.import_module(".".join([*name.parent.parts, name.name.split(".")[0]]))
print(len(names), "compiled modules")
"""


def install(wheel, target, folder, log):
    """Install a wheel and what it depends on.  Returns the folder."""
    site = folder / "site"
    shutil.rmtree(site, ignore_errors=True)
    run([sys.executable, "-m", "pip", "install", "--quiet", "--target", site,
         "--no-compile", "--only-binary", ":all:", "--find-links", DIST,
         *("--platform=%s_%s" % (name, target.arch.name) for name in PLATFORMS),
         "--python-version", target.python, "--implementation", "cp",
         "--abi", "cp" + target.python, "--abi", "abi3", wheel], log)
    return site


def smoke_test(site, target, folder, log):
    """Import everything, check a config, print a file.

    Returns what came out, one line each.  Raises BuildError, pythons.Missing.
    """
    runner, environ = find_runner(target)
    environ = {"PYTHONPATH": str(site), "PATH": os.environ["PATH"],
               "HOME": str(folder), "PYTHONPYCACHEPREFIX": str(folder / "pycache"),
               **environ}

    def call(*args):
        result = subprocess.run(
            [*runner, "-S", *map(str, args)], env=environ, text=True,
            cwd=folder, stdin=subprocess.DEVNULL, capture_output=True)
        with open(log, "a") as file:
            file.write(result.stdout + result.stderr)
        if result.returncode:
            raise BuildError("klippy %s: %s" % (args[1:], result.stderr[-1500:]))
        return result.stdout

    done = [call("-c", IMPORT_ALL, site).strip()]
    samples = pathlib.Path(site, "klippy/simulator/samples")
    call("-m", "klippy", "check", samples / "sample-corexy.cfg")
    output = call("-m", "klippy", "demo")
    if "Done." not in output:
        raise BuildError("klippy demo did not come to its end: " + output[-500:])
    return [*done, "klippy check", "klippy demo to its end"]
