# SPDX-License-Identifier: GPL-3.0-or-later
"""How plug-ins import us: the flat names, and files that shadow built-ins.

`import toolhead`, `import extras.probe` and `import kinematics.extruder` give
the same module objects as `klippy.toolhead` and so on.
"""

import importlib
import importlib.machinery
import logging
import os
import sys

FLAT_NAMES = frozenset((
    "chelper", "clocksync", "configfile", "extras", "gcode", "kinematics",
    "mathutil", "mcu", "msgproto", "pins", "queuelogger", "reactor", "serialhdl",
    "stepper", "toolhead", "webhooks"))


class AliasLoader:
    """Gives an already imported module a second name."""

    def __init__(self, module):
        self.module = module
        self.spec = module.__spec__

    def create_module(self, spec):
        return self.module

    def exec_module(self, module):
        # the import system has put the alias's spec there
        module.__spec__ = self.spec


class AliasFinder:
    """Finds the flat names in the package `klippy`."""

    def find_spec(self, fullname, path=None, target=None):
        """Spec of the packaged module for a flat name, None for others."""
        if fullname.partition(".")[0] not in FLAT_NAMES:
            return None
        packaged = "klippy." + fullname
        try:
            module = importlib.import_module(packaged)
        except ModuleNotFoundError as err:
            if err.name == packaged:
                return None
            raise
        return importlib.machinery.ModuleSpec(
            fullname, AliasLoader(module), origin=module.__spec__.origin)


def install():
    """Let the flat names be imported from now on.  Safe to call again."""
    if not any(isinstance(finder, AliasFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, AliasFinder())


def add_folder(package, path):
    """Search a folder for a package's modules before its own folders.

    Raises FileNotFoundError if there is no such folder.
    """
    folder = os.path.realpath(os.path.expanduser(path))
    if not os.path.isdir(folder):
        raise FileNotFoundError("the plug-in folder '%s' does not exist" % (folder,))
    if folder not in package.__path__:
        package.__path__.insert(0, folder)


def log_shadowing(module, builtin_folders):
    """Log when a module from a user's file hides one of the built-in folders."""
    source = module.__spec__.origin or ""
    if os.path.dirname(source) in builtin_folders:
        return
    name = module.__name__.rpartition(".")[2]
    for folder in builtin_folders:
        builtin = os.path.join(folder, name + ".py")
        if os.path.exists(builtin):
            logging.warning("'%s' is used in place of the built-in '%s'",
                            source, builtin)
            return
