# SPDX-License-Identifier: GPL-3.0-or-later
"""Dictionaries of the firmware's targets, built when they are needed."""

import pathlib
import subprocess
import sys

import scripts

ROOT = pathlib.Path(__file__).resolve().parents[2]
DICTIONARIES = ROOT / "out" / "dictionaries"
_built = set()


def build_dictionary(path):
    """Build the firmware of test/configs/NAME.config for NAME.dict, once."""
    if path in _built:
        return path
    name = path.stem
    config = ROOT / "test" / "configs" / (name + ".config")
    if not config.exists():
        raise scripts.ScriptError("there is no %s for dictionary '%s'"
                                  % (config, path.name))
    out = "out/test-%s/" % (name,)
    result = subprocess.run(
        ["make", "-s", "firmware", "OUT=" + out, "PYTHON=" + sys.executable,
         "KCONFIG_CONFIG=%s" % (config.relative_to(ROOT),)],
        cwd=ROOT, capture_output=True, text=True)
    if result.returncode:
        raise scripts.ScriptError("building %s failed:\n%s" % (name, result.stderr))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((ROOT / out / "klipper.dict").read_bytes())
    _built.add(path)
    return path
