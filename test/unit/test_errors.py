# SPDX-License-Identifier: GPL-3.0-or-later
"""The tree of errors and their texts."""

import pytest

from klippy import errors
from klippy.confignames import find_nearest, propose


def test_one_tree():
    for kind in (errors.ConfigError, errors.CommandError, errors.McuError,
                 errors.ShutdownError):
        assert issubclass(kind, errors.PrinterError)


def test_place_comes_first():
    assert str(errors.ConfigError("bad")) == "bad"
    assert str(errors.ConfigError("bad", errors.Place("p.cfg", 7))) == "p.cfg:7: bad"
    assert str(errors.Place("p.cfg")) == "p.cfg"
    assert errors.Place("a", 1) == errors.Place("a", 1) != errors.Place("a", 2)


def test_as_plain_data():
    unknown = dict.fromkeys(("column", "section", "option", "nearest"))
    assert errors.describe(errors.ConfigError("bad", errors.Place("p.cfg", 7))) == {
        "kind": "ConfigError", "message": "bad", "file": "p.cfg", "line": 7, **unknown}
    assert errors.describe(errors.ConfigError(
        "bad", errors.Place("p.cfg", 7, 3), "fan", "pinn", "pin")) == {
            "kind": "ConfigError", "message": "bad", "file": "p.cfg", "line": 7,
            "column": 3, "section": "fan", "option": "pinn", "nearest": "pin"}
    assert errors.describe(errors.ConfigError("bad", errors.Place("p.cfg")))[
        "line"] is None
    assert errors.describe(errors.McuError("lost", {"mcu": "mcu"})) == {
        "kind": "McuError", "message": "lost", "file": None, "line": None, **unknown}


def test_collecting_flattens():
    a, b, c = (errors.ConfigError(x) for x in "abc")
    assert errors.collect([a]) is a
    both = errors.collect([errors.ConfigErrors([a, b]), c])
    assert both.errors == [a, b, c] and str(both) == "a\nb\nc"


@pytest.mark.parametrize("name, nearest", [
    ("max_sped", "max_speed"), ("MAX_SPEED", "max_speed"), ("zzz", None)])
def test_nearest_name(name, nearest):
    assert find_nearest(name, ["max_speed", "pin"]) == nearest


def test_proposal():
    assert propose("pinn", ["pin"], "[%s]") == "; did you mean [pin]?"
    assert propose("q", []) == ""
