# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes one target from sources to a tried wheel, and keeps note of each step.

A note beside the build holds the sum of what went into it and of what came
out: a step whose note still fits is not done again.
"""

import dataclasses
import hashlib
import importlib.metadata
import json
import os
import shutil
import sys
import threading
import time

from building import (
    DIST,
    BuildError,
    build_greenlet,
    build_wheel,
    make_compiler,
    run,
)
from pythons import Missing, make_headers
from smoke import install, smoke_test
from sources import ROOT, calc_sum, copy_sources, read_time, read_version
from symbols import check_symbols

BUILD = ROOT / "build" / "wheels"
TOOLS = ("ziglang", "cython", "setuptools", "wheel")


class Progress:
    """Tells of each step: when, of which wheel, what."""

    def __init__(self, total):
        self.total = total
        self.done = 0
        self.start = time.monotonic()
        self.lock = threading.Lock()

    def tell(self, name, text, is_last=False):
        with self.lock:
            self.done += is_last
            seconds = time.monotonic() - self.start
            print("[%d:%02d, %d of %d] %s: %s" % (
                seconds // 60, seconds % 60, self.done, self.total, name, text),
                flush=True)


@dataclasses.dataclass
class Result:
    """What became of a wheel."""

    is_good: bool
    text: str


class Notes:
    """Steps done for a target, with what each was done from."""

    def __init__(self, path):
        self.path = path
        try:
            self.steps = json.loads(path.read_text())
        except (OSError, ValueError):
            self.steps = {}

    def find(self, step, made_from):
        """What came out of a step, None unless it was made from just that."""
        note = self.steps.get(step, {})
        return note.get("result") if note.get("from") == made_from else None

    def put(self, step, made_from, result):
        self.steps[step] = {"from": made_from, "result": result}
        self.path.write_text(json.dumps(self.steps, indent=1) + "\n")


def describe_settings(target):
    """What a wheel depends on besides its sources, a text each."""
    return [target.name, target.platform, read_time(), read_version(),
            *(name + importlib.metadata.version(name) for name in TOOLS)]


def sum_file(path):
    """Sum (hex) of a file, "" without it."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else ""


def build(target, folder, notes, log, progress, n_compilers):
    """The wheel of a target, as a path: the one of before if it still fits."""
    sources = calc_sum(*describe_settings(target))
    name, made = notes.find("build", sources) or ("", "none")
    if sum_file(DIST / name if name else folder / "none") == made:
        progress.tell(target.name, "already built from these sources")
        return DIST / name
    progress.tell(target.name, "compiling (%s)" % (log,))
    make_headers(target, folder / "headers", make_compiler(target, folder))
    wheel = build_wheel(target, folder, log, n_compilers=n_compilers)
    notes.put("build", sources, [wheel.name, sum_file(wheel)])
    return wheel


def try_out(wheel, target, folder, notes, log, progress):
    """What a wheel did when it was tried, as text."""
    made = sum_file(wheel)
    told = notes.find("smoke", made)
    if told is not None:
        return told + " (tried before)"
    progress.tell(target.name, "trying %s" % (wheel.name,))
    if not (folder / "headers/Python.h").exists():
        make_headers(target, folder / "headers", make_compiler(target, folder))
    build_greenlet(target, folder, log)
    site = install(wheel, target, folder, log)
    try:
        told = "; ".join(smoke_test(site, target, folder, log))
    except Missing as err:
        told = "NOT RUN: %s; %s" % (err, check_symbols(site, target))
    notes.put("smoke", made, told)
    return told


def compare_again(wheel, target, folder, log, progress):
    """Build a wheel again from nothing in another folder, and compare.

    Returns text.  Raises BuildError if a byte differs.
    """
    progress.tell(target.name, "building again from a copy of the sources")
    again = folder / "again"
    shutil.rmtree(again, ignore_errors=True)
    copy_sources(again / "tree")
    environ = dict(os.environ, SOURCE_DATE_EPOCH=read_time(),
                   KLIPPY_FIRMWARE_VERSION=read_version(),
                   ZIG_GLOBAL_CACHE_DIR=str(again / "cache"))
    run([sys.executable, "scripts/wheels", "--no-smoke", target.name], log,
        cwd=again / "tree", env=environ)
    other = again / "tree/dist" / wheel.name
    if sum_file(other) != sum_file(wheel):
        raise BuildError("built again it is not the same: %s and %s" % (wheel, other))
    shutil.rmtree(again)
    return "built again from nothing: the same bytes"


def make_one(target, options, progress):
    """Make a wheel and try it; returns a Result."""
    folder = BUILD / target.name
    folder.mkdir(parents=True, exist_ok=True)
    notes = Notes(folder / "notes.json")
    log = folder / "log.txt"
    log.unlink(missing_ok=True)
    start = time.monotonic()
    told, failed = [], "NOT MADE"
    try:
        wheel = build(target, folder, notes, log, progress, options.n_compilers)
        told.append("%s, %.1f MB, audited" % (wheel.name, wheel.stat().st_size / 1e6))
        failed = "DOES NOT WORK"
        if not options.no_smoke:
            told.append(try_out(wheel, target, folder, notes, log, progress))
        failed = "NOT REPRODUCED"
        if options.again:
            told.append(compare_again(wheel, target, folder, log, progress))
        failed = ""
    except (Missing, BuildError) as err:
        told.append("%s: %s" % (failed, err))
    result = Result(not failed, "; ".join(told))
    progress.tell(target.name, "%s (%.0f s)" % (
        result.text, time.monotonic() - start), True)
    return result
