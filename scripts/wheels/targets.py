# SPDX-License-Identifier: GPL-3.0-or-later
"""What wheels are built for: versions of Python, and architectures."""

import dataclasses
import fnmatch

PYTHONS = ("311", "312", "313")
# Distributions whose Python runs a wheel of another architecture
SUITES = {"311": "bookworm", "313": "trixie"}
GLIBC = (2, 28)      # no system with such a Python has an older one


@dataclasses.dataclass(frozen=True)
class Arch:
    """An architecture, as each of the tools names it."""

    name: str           # of wheels
    zig: str
    debian: str
    triplet: str        # of Python's modules and Debian's headers
    qemu: str           # "" where this machine runs it


ARCHES = {arch.name: arch for arch in (
    Arch("x86_64", "x86_64-linux-gnu", "amd64", "x86_64-linux-gnu", ""),
    Arch("aarch64", "aarch64-linux-gnu", "arm64", "aarch64-linux-gnu",
         "qemu-aarch64-static"),
    Arch("armv7l", "arm-linux-gnueabihf", "armhf", "arm-linux-gnueabihf",
         "qemu-arm-static"),
)}


@dataclasses.dataclass(frozen=True)
class Target:
    """One wheel."""

    python: str         # "311"
    arch: Arch

    @property
    def name(self):
        return "cp%s-%s" % (self.python, self.arch.name)

    @property
    def version(self):
        return "%s.%s" % (self.python[0], self.python[1:])

    @property
    def platform(self):
        """Tag of the platform."""
        return "manylinux_%d_%d_%s" % (*GLIBC, self.arch.name)

    @property
    def suffix(self):
        """End of the file names of modules."""
        return ".cpython-%s-%s.so" % (self.python, self.arch.triplet)


def list_targets(patterns=()):
    """The targets whose names match one of some patterns (default: all).

    Raises ValueError with the names there are when a pattern matches none.
    """
    targets = [Target(python, arch) for arch in ARCHES.values()
               for python in PYTHONS]
    for pattern in patterns:
        if not any(fnmatch.fnmatch(t.name, pattern) for t in targets):
            raise ValueError("no wheel is named %r; there are: %s" % (
                pattern, " ".join(t.name for t in targets)))
    return [t for t in targets
            if not patterns or any(fnmatch.fnmatch(t.name, p) for p in patterns)]
