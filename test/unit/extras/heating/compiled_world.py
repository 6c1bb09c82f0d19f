# SPDX-License-Identifier: GPL-3.0-or-later
"""heat_world and the modules it judges, compiled together into a folder.

There they are modules of one flat package, so that a reading costs no call
through Python: 10,000 hours are 120 million of them.
"""
import functools
import importlib
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[3]
# in the order of imports
NAMES = ("heat_watch", "heat_stall", "heat_probe", "heat_budget", "heat_guard",
         "heat_world")
FLAGS = ("-X", "cdivision=True", "-X", "boundscheck=False", "-X", "wraparound=False",
         "-X", "initializedcheck=False")


def build(folder):
    """Compile into a folder (a Path)."""
    for name in NAMES:
        for suffix in (".py", ".pxd"):
            here = HERE / (name + suffix)
            there = ROOT / "klippy/extras/heating" / (name + suffix)
            shutil.copy(here if here.exists() else there, folder)
    # what they cimport from the project
    (folder / "klippy").mkdir()
    (folder / "klippy" / "__init__.py").touch()
    shutil.copy(ROOT / "klippy" / "units.pxd", folder / "klippy")
    subprocess.run(
        [sys.executable, "-m", "Cython.Build.Cythonize", "-q", "-i", "-3", *FLAGS,
         *(str(folder / (name + ".py")) for name in NAMES)], check=True, cwd=folder)
    shutil.rmtree(folder / "klippy")


@functools.cache
def load(folder):
    """(heat_world, heat_watch, heat_stall, heat_probe, heat_budget, heat_guard)."""
    kept = {name: sys.modules.pop(name, None) for name in NAMES}
    sys.path.insert(0, str(folder))
    try:
        modules = [importlib.import_module(name) for name in NAMES]
    finally:
        sys.path.remove(str(folder))
        for name in NAMES:
            del sys.modules[name]
        # what others import by these names is not compiled
        sys.modules.update((n, m) for n, m in kept.items() if m is not None)
    assert all(module.__file__.endswith(".so") for module in modules), folder
    return modules[-1], *modules[:-1]
