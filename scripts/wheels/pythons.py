# SPDX-License-Identifier: GPL-3.0-or-later
"""Pythons of this machine and of others: headers, and what runs a wheel.

A Python of another architecture is Debian's, unpacked (not installed) into a
cache folder.  Its headers are used as they are.  For a version that Debian
does not have, the headers are those of this machine's Python of that version
with the sizes of the architecture; a compiler checks each of them.
"""

import os
import pathlib
import re
import shutil
import subprocess
import threading

from targets import SUITES, Target

CACHE = pathlib.Path(os.environ.get(
    "KLIPPY_WHEELS_CACHE", "~/.cache/klippy-wheels")).expanduser()
SIZE_LINE = re.compile(r"^#define ((?:SIZEOF|ALIGNOF)_\w+) (\d+)$", re.M)
UNPACKING = threading.Lock()     # two wheels may need the same one
# What a size is called in C, where that is not its name in lower case
TYPES = {"VOID_P": "void *", "_BOOL": "_Bool", "FPOS_T": None, "KEY_T": None,
         "PTHREAD_KEY_T": None, "PTHREAD_T": None, "WCHAR_T": "__WCHAR_TYPE__",
         "SIZE_T": "__SIZE_TYPE__", "UINTPTR_T": "__UINTPTR_TYPE__",
         "MAX_ALIGN_T": None, "OFF_T": None, "PID_T": "int", "TIME_T": None}


class Missing(Exception):
    """Something that a wheel needs is not there; the text says what."""


def find_local(version):
    """This machine's Python of a version ("3.12").  Raises Missing."""
    pyenv = pathlib.Path("~/.pyenv/versions").expanduser()
    found = [shutil.which("python" + version)]
    found += sorted(pyenv.glob(version + ".*/bin/python" + version))
    for path in filter(None, found):
        code = "import sysconfig; print(sysconfig.get_paths()['include'])"
        result = subprocess.run([path, "-c", code], text=True, capture_output=True)
        include = pathlib.Path(result.stdout.strip() or "/nowhere")
        if result.returncode == 0 and (include / "Python.h").exists():
            return pathlib.Path(path), include
    raise Missing("no Python %s with headers on this machine" % (version,))


def find_runner(target):
    """How a Python of a target starts here: (command, environment).

    Raises Missing.
    """
    if not target.arch.qemu:
        try:
            return [str(find_local(target.version)[0])], {}
        except Missing:
            if target.python not in SUITES:
                raise
    root = unpack_debian(target)
    python = str(root / "usr/bin" / ("python" + target.version))
    home = {"PYTHONHOME": str(root / "usr")}
    if target.arch.qemu:
        return [target.arch.qemu, "-L", str(root), python], home
    libraries = "%s/usr/lib/%s" % (root, target.arch.triplet)
    loader = libraries + "/ld-linux-x86-64.so.2"
    return [loader, "--library-path", libraries, python], home


def unpack_debian(target):
    """Folder with Debian's Python of a target.  Raises Missing."""
    suite = SUITES.get(target.python)
    if suite is None:
        raise Missing("no Debian release has Python " + target.version)
    root = CACHE / ("%s-%s" % (suite, target.arch.debian))
    with UNPACKING:
        if not (root / "complete").exists():
            unpack(target, suite, root)
        link_libraries(root)
    return root


def link_libraries(root):
    """Where programs expect their loader: releases have all in usr by now."""
    if not (root / "lib").exists():
        (root / "lib").symlink_to("usr/lib")


def unpack(target, suite, root):
    """Fill a folder with Debian's Python of a target.  Raises Missing."""
    if not shutil.which("mmdebstrap"):
        raise Missing("mmdebstrap is not installed")
    shutil.rmtree(root, ignore_errors=True)
    root.parent.mkdir(parents=True, exist_ok=True)
    name = "python" + target.version
    print("unpacking %s of %s for %s" % (name, suite, target.arch.debian), flush=True)
    result = subprocess.run(
        ["mmdebstrap", "--quiet", "--variant=extract",
         "--architectures=" + target.arch.debian,
         "--include=%s,lib%s-dev,libstdc++6" % (name, name), suite, str(root),
         *find_mirror()],
        text=True, capture_output=True)
    if result.returncode:
        raise Missing("cannot unpack %s of Debian %s: %s" % (
            name, suite, result.stderr.strip().splitlines()[-1]))
    (root / "complete").touch()


def find_mirror():
    """The archive that this machine's apt takes, in a list; [] if not known."""
    result = subprocess.run(["apt-get", "indextargets", "--format", "$(REPO_URI)"],
                            text=True, capture_output=True)
    uris = [uri for uri in result.stdout.split()
            if uri.rstrip("/").endswith("/debian")]
    return uris[:1]


def make_headers(target, folder, compiler):
    """Put the headers of a target into a folder.  Raises Missing."""
    shutil.rmtree(folder, ignore_errors=True)
    if target.python in SUITES:
        include = unpack_debian(target) / "usr/include"
        name = "python" + target.version
        shutil.copytree(include / name, folder)
        shutil.copy(include / target.arch.triplet / name / "pyconfig.h", folder)
    else:
        shutil.copytree(find_local(target.version)[1], folder)
        if target.arch.qemu:
            take_sizes(folder / "pyconfig.h", target)
    check_sizes(folder, compiler)


def take_sizes(config, target):
    """Give a pyconfig.h the sizes of another version's of the architecture."""
    other = Target(min(SUITES), target.arch)
    theirs = (unpack_debian(other) / "usr/include" / target.arch.triplet
              / ("python" + other.version) / "pyconfig.h").read_text()
    sizes = dict(SIZE_LINE.findall(theirs))
    text = SIZE_LINE.sub(
        lambda m: "#define %s %s" % (m[1], sizes.get(m[1], m[2])),
        config.read_text())
    # inline assembly of the processor that this file was made for
    text = re.sub(r"^#define (HAVE_GCC_ASM_\w+|HAVE_UINT128\w*|HAVE_GCC_UINT128_T) 1$",
                  r"/* \1 is not for this architecture */", text, flags=re.M)
    config.write_text(text)


def check_sizes(folder, compiler):
    """Have the compiler compare pyconfig.h with itself.  Raises Missing."""
    lines = ['#include "%s/pyconfig.h"' % (folder,)]
    for name, _ in SIZE_LINE.findall((folder / "pyconfig.h").read_text()):
        kind, _, what = name.partition("_")
        c_type = TYPES.get(what, what.lower().replace("_", " "))
        if c_type:
            lines.append('_Static_assert(%s == %s(%s), "%s");' % (
                name, "sizeof" if kind == "SIZEOF" else "_Alignof", c_type, name))
    source = folder / "check_sizes.c"
    source.write_text("\n".join(lines) + "\n")
    made = source.with_suffix(".o")
    result = subprocess.run([compiler, "-c", str(source), "-o", str(made)], text=True,
                            capture_output=True)
    source.unlink()
    made.unlink(missing_ok=True)
    if result.returncode:
        raise Missing("wrong sizes in pyconfig.h: " + result.stderr.strip())
