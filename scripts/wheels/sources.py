# SPDX-License-Identifier: GPL-3.0-or-later
"""What a wheel is made of: the files, a sum over them, their time and version.

Two builds of the same files must give the same bytes, so that nothing here
depends on what else is in the folder, or on a commit that changed other files.
"""

import hashlib
import os
import pathlib
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARTS = ("klippy", "klippy_ext", "src", "lib", "config", "scripts", "test/configs",
         "setup.py", "pyproject.toml", "MANIFEST.in", "Makefile", "Kconfig", "VERSION",
         "COPYING", "README.md")
# Of scripts/, what a wheel depends on
SCRIPTS = ("build_commands.py", "kconfig.py", "building.py", "packing.py",
           "pythons.py", "sources.py", "targets.py")
# What builds leave between the sources
BUILT = (".so", ".pyc", ".o")
EPOCH = 315532800       # 1980, the first year a zip file knows


def ask_git(*args):
    """Output of a git command about the sources, "" without git."""
    try:
        result = subprocess.run(["git", "-C", str(ROOT), *args, "--", *PARTS],
                                text=True, capture_output=True)
    except OSError:
        return ""
    return result.stdout.strip() if result.returncode == 0 else ""


def list_sources(root=ROOT):
    """Paths of all files that can go into a wheel, sorted."""
    paths = []
    for part in PARTS:
        top = root / part
        found = [top] if top.is_file() else top.rglob("*")
        paths += [path for path in found if path.is_file()
                  and path.suffix not in BUILT and "__pycache__" not in path.parts]
    return sorted(paths)


def calc_sum(*settings, root=ROOT):
    """Sum (hex) over the sources and some settings, each a text."""
    total = hashlib.sha256("\0".join(settings).encode())
    for path in list_sources(root):
        if path.is_relative_to(root / "scripts") and path.name not in SCRIPTS:
            continue
        total.update(b"\0%s\0" % (str(path.relative_to(root)).encode(),))
        total.update(hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()


def copy_sources(folder):
    """Copy all sources into an empty folder."""
    for path in list_sources():
        target = folder / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, target)


def read_time():
    """Time of the newest change of the sources (s, text)."""
    return (os.environ.get("SOURCE_DATE_EPOCH")
            or ask_git("log", "-1", "--format=%ct") or str(EPOCH))


def read_version():
    """Version that the firmware inside names, in the shape of git-describe."""
    told = os.environ.get("KLIPPY_FIRMWARE_VERSION")
    if told:
        return told
    version = "v" + (ROOT / "VERSION").read_text().strip()
    commit = ask_git("log", "-1", "--abbrev=8", "--format=%h")
    changed = ask_git("status", "--porcelain")
    return version + ("-g" + commit if commit else "") + ("-dirty" if changed else "")
