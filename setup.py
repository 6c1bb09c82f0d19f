# SPDX-License-Identifier: GPL-3.0-or-later
"""Build of the host: one C library, one extension a .pyx and a typed .py.

A module of `klippy` is compiled if and only if a .pxd lies beside it.
KLIPPY_ONLY=name[,name...] limits a build to some extensions.

A build makes again what is older than a file that went into it: the compiler
notes these files beside each object (-MMD), Cython finds its .pxd by itself.
"""

import json
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


def read_depfile(path):
    """The files that made an object, by the compiler's note beside it.

    Without a note the missing note itself, which is newer than anything.
    """
    if not path.exists():
        return [path]
    names = path.read_text().replace("\\\n", " ").partition(": ")[2]
    return [pathlib.Path(name) for name in names.split()]


def is_older(target, sources):
    """True if a file must be made (again) from others."""
    if not target.exists() or not all(path.exists() for path in sources):
        return True
    made = target.stat().st_mtime
    return any(path.stat().st_mtime > made for path in sources)


def note_settings(path, settings):
    """Keep the settings of a build in a file that changes only with them.

    Returns True when they are others than those of the last build.
    """
    text = json.dumps(settings, indent=1, sort_keys=True) + "\n"
    if path.exists() and path.read_text() == text:
        return False
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return True


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
        extra_compile_args=["-O2", "-g1", "-Wno-unused-function", "-MMD"],
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

    def build_extension(self, ext):
        temp = pathlib.Path(self.build_temp)
        settings = temp / "settings" / (ext.name + ".json")
        note_settings(settings, [self.compiler.compiler_so, ext.extra_compile_args,
                                 ext.libraries, ext.extra_link_args])
        ext.depends = [str(settings)]
        for source in ext.sources:
            depfile = (temp / source).with_suffix(".d")
            ext.depends += map(str, read_depfile(depfile))
        super().build_extension(ext)

    def add_simulator(self, folder):
        """Put the simulator's firmware and the samples into the package."""
        out = pathlib.Path(self.build_temp).resolve() / "simulator"
        subprocess.check_call(
            ["make", "--no-print-directory", "firmware", "OUT=%s/" % (out,),
             "KCONFIG_CONFIG=test/configs/simulator.config",
             "PORT_OUTPUTS=%s/klipper.so" % (out,), "PYTHON=" + sys.executable]
            + os.environ.get("KLIPPY_FIRMWARE_MAKE", "").split())
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
        settings = temp / "settings.json"
        note_settings(settings, [cc, flags])
        objects, jobs = [], []
        for source in sorted(CSRC.glob("*.c")):
            obj = temp / (source.stem + ".o")
            objects.append(obj)
            if is_older(obj, [settings] + read_depfile(obj.with_suffix(".d"))):
                jobs.append((source, cc + flags + ["-MMD", "-c", str(source),
                                                   "-o", str(obj)]))
        run_all(jobs, self.parallel)
        library = temp / LIBRARY
        if is_older(library, objects):
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
    folder = pathlib.Path("build/cython")
    changed = note_settings(folder / "settings.json", DIRECTIVES)
    return cythonize(list_extensions(), compiler_directives=DIRECTIVES,
                     build_dir=str(folder), force=changed,
                     nthreads=0 if os.environ.get("KLIPPY_ONLY")
                     else os.cpu_count() or 1)


if __name__ == "__main__":
    os.chdir(ROOT)
    setup(
        version=read_version(),
        packages=find_namespace_packages(
            include=["klippy", "klippy.*", "klippy_ext", "klippy_ext.*"],
            exclude=["klippy_ext.csrc*"]),
        package_data={"": ["*.pxd", "*.toml"], "klippy.simulator.web": ["*.html"],
                      "klippy.schema.rooms": ["*.cfg"]},
        include_package_data=False,
        ext_modules=cythonized() if len(sys.argv) > 1 else [],
        cmdclass={"build_ext": BuildExt}, zip_safe=False)
