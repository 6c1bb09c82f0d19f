# SPDX-License-Identifier: GPL-3.0-or-later
"""A build makes again what depends on a changed file, and nothing else."""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = {
    "VERSION": "1.0",
    "klippy_ext/csrc/inner.h": "#define INNER 1\n",
    "klippy_ext/csrc/one.h": '#include "inner.h"\nint one(void);\n',
    "klippy_ext/csrc/two.h": "int two(void);\n",
    "klippy_ext/csrc/one.c": '#include "one.h"\nint one(void) { return INNER; }\n',
    "klippy_ext/csrc/two.c": '#include "two.h"\nint two(void) { return 2; }\n',
    "klippy_ext/c_one.pxd": 'cdef extern from "one.h":\n    int one()\n',
    "klippy_ext/c_two.pxd": 'cdef extern from "two.h":\n    int two()\n',
    "klippy_ext/wone.pyx": "from klippy_ext.c_one cimport one\n"
                           "def call():\n    return one()\n",
    "klippy_ext/wtwo.pyx": "from klippy_ext.c_two cimport two\n"
                           "def call():\n    return two()\n",
    "klippy/base.py": "class Base:\n    def get(self):\n        return 5\n",
    "klippy/base.pxd": "cdef class Base:\n    cpdef int get(self)\n",
    "klippy/user.py": "from .base import Base\n"
                      "class User(Base):\n    pass\n",
    "klippy/user.pxd": "from klippy.base cimport Base\n"
                       "cdef class User(Base):\n    cdef int x\n",
    "klippy/alone.py": "def f(x):\n    return x\n",
    "klippy/alone.pxd": "cpdef int f(int x)\n",
}
OBJECTS = {"one", "two"}
MODULES = {"wone", "wtwo", "base", "user", "alone"}


class Tree:
    """A small tree with the project's own setup.py."""

    def __init__(self, folder):
        self.folder = folder
        shutil.copy(ROOT / "setup.py", folder)
        (folder / "pyproject.toml").write_text(
            '[project]\nname = "small"\ndynamic = ["version"]\n')
        for name, text in FILES.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        for package in ("klippy", "klippy_ext"):
            (folder / package / "__init__.py").write_text("")

    def build(self, **environ):
        """Build; returns the names of the objects and modules that were made."""
        before = self._list_made()
        result = subprocess.run(
            [sys.executable, "setup.py", "-q", "build_ext", "--inplace"],
            cwd=self.folder, text=True, capture_output=True,
            env={**os.environ, "KLIPPY_CFLAGS": "", **environ})
        assert result.returncode == 0, result.stdout + result.stderr
        after = self._list_made()
        return {path.name.partition(".")[0] for path, made in after.items()
                if before.get(path) != made}

    def _list_made(self):
        return {path: path.stat().st_mtime_ns for pattern in
                ("build/temp*/csrc/*.o", "build/lib*/**/*.so")
                for path in self.folder.glob(pattern)}


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    pytest.importorskip("Cython")
    tree = Tree(tmp_path_factory.mktemp("tree"))
    assert tree.build() == OBJECTS | MODULES
    return tree


def test_nothing_changed(tree):
    assert tree.build() == set()


@pytest.mark.parametrize("names, made", [
    (["klippy_ext/csrc/two.c", "klippy/user.pxd"], {"two", "user"}),
    (["klippy_ext/csrc/two.h", "klippy/alone.py"], {"two", "wtwo", "alone"}),
    (["klippy_ext/csrc/inner.h"], {"one", "wone"}),
    (["klippy_ext/c_one.pxd", "klippy/base.pxd"], {"wone", "base", "user"}),
])
def test_touched(tree, names, made):
    for name in names:
        os.utime(tree.folder / name)
    assert tree.build() == made


def test_other_flags(tree):
    """Flags of the C library are part of what it is made from."""
    assert tree.build(KLIPPY_CFLAGS="-DSOMETHING") == OBJECTS


def test_header_that_is_gone(tree):
    """A file that nobody includes any more stops nothing."""
    (tree.folder / "klippy_ext/csrc/one.h").write_text("int one(void);\n")
    (tree.folder / "klippy_ext/csrc/one.c").write_text(
        '#include "one.h"\nint one(void) { return 1; }\n')
    (tree.folder / "klippy_ext/csrc/inner.h").unlink()
    assert tree.build(KLIPPY_CFLAGS="-DSOMETHING") == {"one", "wone"}


def test_broken_source_is_made_again(tree):
    path = tree.folder / "klippy_ext/csrc/two.c"
    good = path.read_text()
    path.write_text("no C\n")
    with pytest.raises(AssertionError, match="compiling the C core failed"):
        tree.build()
    path.write_text(good)
    assert "two" in tree.build()
