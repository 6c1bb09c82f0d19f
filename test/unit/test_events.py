# SPDX-License-Identifier: GPL-3.0-or-later
"""Events that our code sends and handles are declared."""

import ast
import pathlib

from klippy import events

ROOT = pathlib.Path(__file__).resolve().parents[2]
CALLS = ("send_event", "_send_protected", "register_event_handler")


def list_event_names():
    """(place, event name, number of arguments or None) in our sources."""
    for path in sorted((ROOT / "klippy").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if name not in CALLS or not node.args:
                continue
            first = node.args[0]
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                is_sent = name != "register_event_handler"
                has_star = any(isinstance(a, ast.Starred) for a in node.args)
                yield ("%s:%d" % (path.relative_to(ROOT), node.lineno), first.value,
                       len(node.args) - 1 if is_sent and not has_star else None)


def test_all_events_in_use_are_declared():
    unknown = [(place, name) for place, name, _ in list_event_names()
               if not events.is_declared(name)]
    assert unknown == []


def test_events_are_sent_with_their_payload():
    wrong = [(place, name) for place, name, count in list_event_names()
             if count is not None and name in events.EVENTS
             and count != len(events.EVENTS[name].payload)]
    assert wrong == []


def test_scan_sees_the_printer_s_own_events():
    assert "klippy:disconnect" in {name for _, name, _ in list_event_names()}


def test_undeclared_name_is_known_as_such():
    assert not events.is_declared("klippy:redy")
    assert events.is_declared("menu:any") and events.is_declared("klippy:ready")
