# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the .py of the package's modules win over their compiled form."""

import importlib.machinery
import sys


class PureFinder:
    """Path finder for the modules of one package that sees only sources."""

    def __init__(self, package):
        self.prefix = package + "."

    def find_spec(self, fullname, path=None, target=None):
        """Spec of a source module below the package, None for all others."""
        if not fullname.startswith(self.prefix) or path is None:
            return None
        loaders = (importlib.machinery.SourceFileLoader,
                   importlib.machinery.SOURCE_SUFFIXES)
        for folder in path:
            finder = importlib.machinery.FileFinder(folder, loaders)
            spec = finder.find_spec(fullname)
            if spec is not None and spec.loader is not None:
                return spec
        return None


def install(package="klippy"):
    """Prefer sources from now on; call before importing the modules."""
    sys.meta_path.insert(0, PureFinder(package))
