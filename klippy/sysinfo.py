# SPDX-License-Identifier: GPL-3.0-or-later
"""What is told about the machine and the software: cpu, version, stale builds."""

import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent


def get_cpu_info():
    """Text with the number of cores and the cpu's model."""
    try:
        text = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
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
    try:
        result = subprocess.run(
            ["git", "-C", str(ROOT), "describe", "--always", "--tags", "--long",
             "--dirty"], capture_output=True, text=True, timeout=5, check=False)
        if result.returncode == 0 and (ROOT / ".git").exists():
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
    path = ROOT / "VERSION"
    if path.exists():
        return path.read_text(encoding="utf-8").strip()
    from importlib import metadata
    try:
        return metadata.version("klippy-host")
    except metadata.PackageNotFoundError:
        return "?"


def find_stale_modules(folder=None):
    """Sources of the package that are newer than their compiled form."""
    if os.environ.get("KLIPPY_PURE") == "1":
        return []
    stale = []
    for compiled in sorted(pathlib.Path(folder or ROOT / "klippy").rglob("*.so")):
        source = compiled.with_name(compiled.name.partition(".")[0] + ".py")
        if source.exists() and source.stat().st_mtime > compiled.stat().st_mtime:
            stale.append(str(source))
    return stale
