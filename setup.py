# SPDX-License-Identifier: GPL-3.0-or-later
"""Build of the host: one C library, one extension a .pyx and a typed .py.

A module of `klippy` is compiled if and only if a .pxd lies beside it.
KLIPPY_ONLY=name[,name...] limits a build to some extensions.
"""

import os
import pathlib
import shutil
import subprocess
import sys

from setuptools import Extension, find_namespace_packages, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent
CSRC = pathlib.Path("klippy_ext/csrc")
LIBRARY = "libklippyc.so"
C_FLAGS = ["-std=gnu11", "-O3", "-g", "-fPIC", "-Wall", "-Wextra", "-Wshadow",
           "-Wconversion", "-Wno-sign-conversion", "-fno-math-errno"]
# Compiled modules behave as uncompiled ones do, indexes and divisions too; a
# module whose hot path was measured to need it says otherwise in its first lines
DIRECTIVES = {"language_level": 3, "initializedcheck": False,
              "embedsignature": True, "annotation_typing": False}


def read_version():
    """Version of the project from its VERSION file."""
    return (ROOT / "VERSION").read_text().strip()


def is_wanted(name):
    only = os.environ.get("KLIPPY_ONLY")
    return not only or name in only.split(",")


def list_extensions():
    """All Extension objects, klippy_ext wrappers first."""
    extensions = []
    for path in sorted(pathlib.Path("klippy_ext").glob("*.pyx")):
        extensions.append((".".join(path.with_suffix("").parts), path))
    for path in sorted(pathlib.Path("klippy").rglob("*.pxd")):
        source = path.with_suffix(".py")
        if source.exists() and source.name != "__init__.py":
            extensions.append((".".join(path.with_suffix("").parts), source))
    return [make_extension(name, path) for name, path in extensions
            if is_wanted(name)]


def make_extension(name, path):
    depth = len(path.parts) - 1
    origin = "/".join(["$ORIGIN"] + [".."] * depth + ["klippy_ext"])
    uses_library = path.suffix == ".pyx"
    return Extension(
        name, [str(path)], include_dirs=[str(CSRC)],
        libraries=["klippyc"] if uses_library else [],
        extra_compile_args=["-O2", "-g1", "-Wno-unused-function"],
        extra_link_args=["-Wl,-rpath," + origin] if uses_library else [])


class BuildExt(build_ext):
    """Compile the C library first, then link every wrapper to it."""

    def finalize_options(self):
        super().finalize_options()
        if self.parallel is None:
            self.parallel = os.cpu_count() or 1

    def run(self):
        library = self.build_library()
        for ext in self.extensions:
            ext.library_dirs = [str(library.parent)]
            ext.depends = [str(p) for p in CSRC.glob("*.h")]
        super().run()
        if not self.inplace:
            target = pathlib.Path(self.build_lib) / "klippy_ext" / LIBRARY
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(library, target)
            self.add_simulator(pathlib.Path(self.build_lib) / "klippy/simulator")
        else:
            # a process that runs may have the old one mapped: never write into it
            new = ROOT / "klippy_ext" / (LIBRARY + ".new")
            shutil.copy2(library, new)
            os.replace(new, ROOT / "klippy_ext" / LIBRARY)

    def add_simulator(self, folder):
        """Put the simulator's firmware and the samples into the package."""
        out = pathlib.Path(self.build_temp).resolve() / "simulator"
        subprocess.check_call(
            ["make", "--no-print-directory", "firmware", "OUT=%s/" % (out,),
             "KCONFIG_CONFIG=test/configs/simulator.config",
             "PYTHON=" + sys.executable])
        (folder / "firmware").mkdir(parents=True, exist_ok=True)
        shutil.copy2(out / "klipper.so", folder / "firmware")
        samples = folder / "samples"
        shutil.rmtree(samples, ignore_errors=True)
        shutil.copytree(ROOT / "config", samples)

    def build_library(self):
        temp = pathlib.Path(self.build_temp) / "csrc"
        temp.mkdir(parents=True, exist_ok=True)
        cc = os.environ.get("CC", "cc").split()
        flags = C_FLAGS + os.environ.get("KLIPPY_CFLAGS", "").split()
        headers = max(p.stat().st_mtime for p in CSRC.glob("*.h"))
        objects, jobs = [], []
        for source in sorted(CSRC.glob("*.c")):
            obj = temp / (source.stem + ".o")
            objects.append(obj)
            newest = max(headers, source.stat().st_mtime)
            if obj.exists() and obj.stat().st_mtime > newest:
                continue
            jobs.append((source, cc + flags + ["-c", str(source), "-o", str(obj)]))
        run_all(jobs, self.parallel)
        library = temp / LIBRARY
        subprocess.check_call(cc + ["-shared", "-o", str(library)]
                              + [str(o) for o in objects]
                              + ["-lm", "-lpthread", "-ldl"])
        return library


def run_all(jobs, parallel):
    """Run compiler commands, `parallel` at a time; exit on the first error."""
    running = []
    for source, command in jobs:
        print("compiling", source)
        running.append(subprocess.Popen(command))
        if len(running) >= parallel:
            check_exit(running.pop(0))
    for process in running:
        check_exit(process)


def check_exit(process):
    if process.wait():
        sys.exit("compiling the C core failed: " + " ".join(process.args))


def cythonized():
    from Cython.Build import cythonize
    return cythonize(list_extensions(), compiler_directives=DIRECTIVES,
                     build_dir="build/cython",
                     nthreads=0 if os.environ.get("KLIPPY_ONLY")
                     else os.cpu_count() or 1)


if __name__ == "__main__":
    os.chdir(ROOT)
    setup(
        version=read_version(),
        packages=find_namespace_packages(
            include=["klippy", "klippy.*", "klippy_ext", "klippy_ext.*"],
            exclude=["klippy_ext.csrc*"]),
        package_data={"": ["*.pxd"]}, include_package_data=False,
        ext_modules=cythonized() if len(sys.argv) > 1 else [],
        cmdclass={"build_ext": BuildExt}, zip_safe=False)
