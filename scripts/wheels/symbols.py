# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares what compiled modules need of Python with what a Python offers.

For the wheels that no Python here can run: its interface has the same names on
all architectures, so that this machine's Python of the same version tells.
"""

import pathlib
import subprocess

from building import BuildError
from pythons import find_local

LIBRARY = "import sysconfig; print(sysconfig.get_config_var('LIBDIR'))"


def read_symbols(path, defined):
    """Names of dynamic symbols that an ELF file defines, or that it needs."""
    from elftools.elf.elffile import ELFFile
    with open(path, "rb") as file:
        table = ELFFile(file).get_section_by_name(".dynsym")
        return {symbol.name for symbol in table.iter_symbols()
                if (symbol["st_shndx"] != "SHN_UNDEF") == defined}


def find_library(python, version):
    """The file of a Python that holds its interface."""
    folder = subprocess.run([python, "-c", LIBRARY], text=True, check=True,
                            capture_output=True).stdout.strip()
    library = pathlib.Path(folder, "libpython%s.so.1.0" % (version,))
    return library if library.exists() else pathlib.Path(python).resolve()


def check_symbols(site, target):
    """Check the modules below a folder; returns what was found, as text.

    Raises BuildError with the names that are missing, pythons.Missing.
    """
    python, _ = find_local(target.version)
    offered = read_symbols(find_library(python, target.version), True)
    needed = set()
    for path in site.rglob("*%s" % (target.suffix,)):
        needed |= {name for name in read_symbols(path, False)
                   if name.startswith(("Py", "_Py"))}
    if not needed or needed - offered:
        raise BuildError("Python %s does not have: %s" % (
            target.version, " ".join(sorted(needed - offered)) or "any module"))
    return "all %d names of Python's interface are there" % (len(needed),)
