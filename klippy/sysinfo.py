# SPDX-License-Identifier: GPL-3.0-or-later
"""What is told about the machine and the software: cpu, version, stale builds."""

import os

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))


def get_cpu_info():
    """Text with the number of cores and the cpu's model."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as source:
            text = source.read()
    except OSError:
        return "?"
    fields = {}
    for line in text.splitlines():
        name, _, value = line.partition(":")
        fields.setdefault(name.strip().lower(), value.strip())
    model = fields.get("model name") or fields.get("model") or "?"
    return "%d core %s" % (os.cpu_count() or 1, model)


def get_version():
    """Version in the shape of git-describe; that of the package without git."""
    if not os.path.exists(os.path.join(ROOT, ".git")):
        return read_package_version()
    import subprocess
    try:
        result = subprocess.run(
            ["git", "-C", ROOT, "describe", "--always", "--tags", "--long",
             "--dirty"], capture_output=True, text=True, timeout=5, check=False)
        if result.returncode == 0:
            return _shape(result.stdout.strip())
    except (OSError, subprocess.SubprocessError):
        pass
    return read_package_version()


def _shape(described):
    """v1.2.3-4-gabcdef also where there is no tag to count from."""
    if described.startswith("v"):
        return described
    return "v%s-0-g%s" % (read_package_version(), described)


def read_package_version():
    """The version of the source tree or of the installed package."""
    path = os.path.join(ROOT, "VERSION")
    if os.path.exists(path):
        with open(path, encoding="utf-8") as source:
            return source.read().strip()
    from importlib import metadata
    try:
        return metadata.version("klippy-host")
    except metadata.PackageNotFoundError:
        return "?"


def find_stale_modules(folder=None):
    """Sources of the package that are newer than their compiled form.

    Of an installed package nobody edits the files, and their times say only in
    which order they were unpacked.
    """
    is_installed = folder is None and not os.path.exists(os.path.join(ROOT, "setup.py"))
    if is_installed or os.environ.get("KLIPPY_PURE") == "1":
        return []
    stale = []
    for where, _, names in os.walk(folder or os.path.join(ROOT, "klippy")):
        for name in names:
            if name.endswith(".so"):
                source = os.path.join(where, name.partition(".")[0] + ".py")
                if is_newer(source, os.path.join(where, name)):
                    stale.append(source)
    return sorted(stale)


def is_newer(path, other):
    """True if there is such a file, and it is newer than the other."""
    try:
        return os.stat(path).st_mtime > os.stat(other).st_mtime
    except OSError:
        return False
