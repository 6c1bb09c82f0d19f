# SPDX-License-Identifier: GPL-3.0-or-later
"""The C core's runs (runcurve, runline, runtrack) from Python, and plain models.

Steps are counted from 1; step k of a run comes interval * k + add * k(k - 1)/2
ticks after its start.  Windows are (wanted clock, error).
"""

import ctypes
import pathlib

from hypothesis import strategies as st

import klippy_ext

CORE = ctypes.CDLL(str(pathlib.Path(klippy_ext.__path__[0]) / "libklippyc.so"))
LINE_MAX = 512


class View(ctypes.Structure):
    _fields_ = [("wanted", ctypes.POINTER(ctypes.c_double)),
                ("error", ctypes.POINTER(ctypes.c_double)),
                ("start", ctypes.c_double)]


class Curve(ctypes.Structure):
    _fields_ = [("interval", ctypes.c_double), ("add", ctypes.c_double)]


class Track(ctypes.Structure):
    _fields_ = [("add", ctypes.c_double), ("low", ctypes.c_double),
                ("high", ctypes.c_double)]


class Line(ctypes.Structure):
    _fields_ = [("view", View), ("n", ctypes.c_int), ("n_parts", ctypes.c_int),
                *((name, ctypes.c_double * LINE_MAX)
                  for name in ("part", "low", "high"))]


CORE.runcurve_count_met.restype = CORE.runtrack_run.restype = ctypes.c_int64
CORE.runcurve_count_met.argtypes = [ctypes.POINTER(Curve), ctypes.POINTER(View),
                                    ctypes.c_int64, ctypes.c_int64]
CORE.runtrack_init.argtypes = [ctypes.POINTER(Track), ctypes.c_double]
CORE.runtrack_run.argtypes = [ctypes.POINTER(Track), ctypes.POINTER(View),
                              ctypes.c_int64, ctypes.c_int64]
CORE.runtrack_aim.restype = ctypes.c_double
CORE.runtrack_aim.argtypes = [ctypes.POINTER(Track), ctypes.c_double, ctypes.c_double,
                              ctypes.POINTER(Curve)]
CORE.runline_find_longest.argtypes = [ctypes.POINTER(Line), ctypes.c_int,
                                      ctypes.c_double, ctypes.POINTER(Curve)]
CORE.runline_find_intervals.argtypes = [
    ctypes.POINTER(Line), ctypes.c_double, ctypes.c_int,
    ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_double)]


def make_view(start, windows):
    """A View of windows; two more may be looked at, as in runfit.h."""
    size = len(windows) + 2
    wanted, error = ((ctypes.c_double * size)(*values)
                     for values in zip(*windows, strict=True))
    return View(wanted, error, start)


def make_line(start, windows):
    line = Line()
    line.kept = make_view(start, windows)       # the core has its pointers
    CORE.runline_init(ctypes.byref(line), ctypes.byref(line.kept))
    return line


def get_step(interval, add, k):
    """Clock of step k from the start; whole."""
    return interval * k + add * (k * (k - 1) // 2)


def is_met(start, window, k, interval, add):
    return abs(start + get_step(interval, add, k) - window[0]) <= window[1]


def count_met(start, windows, first, interval, add):
    """How many windows, the first for step `first`, are met before a miss."""
    for i, window in enumerate(windows):
        if not is_met(start, window, first + i, interval, add):
            return i
    return len(windows)


def narrow_interval(start, window, k, add, low, high):
    """Whole intervals between two with which step k meets a window, exactly."""
    wanted = window[0] - start - get_step(0, add, k)
    return max(low, -((window[1] - wanted) // k)), min(high, (wanted + window[1]) // k)


def find_intervals(start, windows, add, low=1, high=2 ** 32 - 1, first=1):
    """(how many windows some interval meets, the least, the greatest)."""
    for i, window in enumerate(windows):
        least, most = narrow_interval(start, window, first + i, add, low, high)
        if least > most:
            return i, low, high
        low, high = least, most
    return len(windows), low, high


@st.composite
def paths(draw, max_steps=80, max_add=6):
    """(start, windows, interval, add): steps near such a run, by at most `error`
    ticks until somewhere, and as they like from there on."""
    n = draw(st.integers(1, max_steps))
    add = draw(st.integers(-max_add, max_add))
    interval = draw(st.integers(20, 3000)) + max(0, -add) * n
    start = draw(st.integers(0, 2 ** 40))
    error = draw(st.integers(0, 9))
    good = draw(st.integers(0, n))
    off = st.integers(-error, error)
    windows = [(start + get_step(interval, add, k) + draw(off) + 3 * max(0, k - good),
                error) for k in range(1, n + 1)]
    return start, windows, interval, add
