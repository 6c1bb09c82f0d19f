# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles, packs and audits the wheel of a target.

One Python runs every build: Cython's C code fits all versions, headers, file
names and tags are the target's.  The compiler is clang of the package
`ziglang`, which links against the symbols of the oldest glibc that counts,
and keeps each object it made by its sources: the same is not compiled twice.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from packing import normalize
from sources import ROOT, read_time, read_version
from targets import GLIBC

DIST = ROOT / "dist"


class BuildError(Exception):
    """A build failed; the text is the end of what it said."""


def run(command, log, **options):
    """Run a command with its output in a file.  Raises BuildError."""
    with open(log, "a") as file:
        code = subprocess.call([str(word) for word in command], stdout=file,
                               stderr=subprocess.STDOUT, **options)
    if code:
        end = pathlib.Path(log).read_text().splitlines()[-15:]
        raise BuildError("%s (all of it: %s)" % ("\n".join(end), log))


def translate(log):
    """Have Cython write the C files, which are the same for all targets."""
    run([sys.executable, "setup.py", "-q", "--version"], log, cwd=ROOT)


def make_compiler(target, folder, kind="cc"):
    """A script that compiles C (or, "c++", C++) for a target.

    A link without -O would take in all of the compiler's own library
    (200 KB a module on 32-bit ARM) unless sections nobody uses are dropped.
    """
    import ziglang
    zig = pathlib.Path(ziglang.__file__).with_name("zig")
    path = folder / kind
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        '#!/bin/sh\nexec "%s" %s -target %s.%d.%d "$@" -g0 -s %s\n' % (
            zig, kind, target.arch.zig, *GLIBC, " ".join([
                "-ffile-prefix-map=%s=." % (folder,),
                "-ffile-prefix-map=%s=." % (ROOT,),
                "-Wl,--gc-sections", "-Wno-unused-command-line-argument"])))
    path.chmod(0o755)
    return path


def make_environ(target, folder):
    """The environment in which setup.py builds for a target."""
    compiler = make_compiler(target, folder)
    headers = folder / "headers"
    environ = {name: value for name, value in os.environ.items()
               if not name.startswith(("KLIPPY_", "MAKE", "_PYTHON"))}
    environ.update({
        "CC": str(compiler), "CXX": str(make_compiler(target, folder, "c++")),
        "CFLAGS": "-I%s" % (headers,), "CXXFLAGS": "-I%s" % (headers,),
        "LDSHARED": "%s -shared" % (compiler,),
        "LDCXXSHARED": "%s -shared" % (make_compiler(target, folder, "c++"),),
        "SETUPTOOLS_EXT_SUFFIX": target.suffix,
        "_PYTHON_HOST_PLATFORM": "linux-" + target.arch.name,
        "KLIPPY_FIRMWARE_MAKE": "CC=%s LTO_FLAGS=" % (compiler,),
        "KLIPPY_FIRMWARE_VERSION": read_version(),
        "SOURCE_DATE_EPOCH": read_time()})
    return environ


def build_wheel(target, folder, log, source=ROOT, n_compilers=1):
    """Build the wheel of a source folder, with all else in another folder.

    n_compilers: that run at a time.  Returns its path in dist/.
    """
    packed = folder / "packed"
    shutil.rmtree(packed, ignore_errors=True)
    base = folder if source == ROOT else folder / source.name
    shutil.rmtree(base / "lib", ignore_errors=True)
    (base / "egg").mkdir(parents=True, exist_ok=True)
    run([sys.executable, "setup.py", "-q", "egg_info", "--egg-base", base / "egg",
         "build", "--build-base", base, "--parallel", str(n_compilers),
         "--build-lib", base / "lib", "--build-temp", base / "temp",
         "bdist_wheel", "--bdist-dir", base / "bdist", "--dist-dir", packed],
        log, cwd=source, env=make_environ(target, folder))
    wheel = next(packed.glob("*.whl"))
    run([sys.executable, "-m", "wheel", "tags", "--remove",
         "--python-tag", "cp" + target.python, "--abi-tag", "cp" + target.python,
         "--platform-tag", target.platform, wheel], log)
    wheel = next(packed.glob("*.whl"))
    audit(wheel, target, log)
    DIST.mkdir(exist_ok=True)
    normalize(wheel, int(read_time()), DIST / wheel.name)
    return DIST / wheel.name


def audit(wheel, target, log):
    """Check that a wheel keeps what its tag says.  Raises BuildError."""
    result = subprocess.run([sys.executable, "-m", "auditwheel", "show", str(wheel)],
                            text=True, capture_output=True)
    with open(log, "a") as file:
        file.write(result.stdout + result.stderr)
    found = re.search(r'"manylinux_(\d+)_(\d+)_%s"' % (target.arch.name,),
                      result.stdout)
    if result.returncode or not found or (int(found[1]), int(found[2])) > GLIBC:
        raise BuildError("auditwheel: %s%s" % (result.stdout, result.stderr[-500:]))


def build_greenlet(target, folder, log):
    """Build the one dependency that has no wheel for some targets.

    Returns the wheel in dist/, None if the package index has one.
    """
    if target.arch.name != "armv7l":
        return None
    found = list(DIST.glob("greenlet-*-cp%s-cp%s-%s.whl" % (
        target.python, target.python, target.platform)))
    if found:
        return found[0]
    unpacked = folder / "greenlet"
    shutil.rmtree(unpacked, ignore_errors=True)
    run([sys.executable, "-m", "pip", "download", "--quiet", "--no-deps",
         "--no-binary", "greenlet", "--no-build-isolation",
         "--dest", unpacked, "greenlet>=3.0"], log)
    shutil.unpack_archive(next(unpacked.glob("*.tar.gz")), unpacked)
    source = next(path for path in unpacked.iterdir() if path.is_dir())
    return build_wheel(target, folder, log, source=source)
