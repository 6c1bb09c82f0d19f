# SPDX-License-Identifier: GPL-3.0-or-later
"""Dictionaries of firmware that was built without some options of menuconfig."""

from klippy import msgproto
from klippy.mcu import features


def list_options():
    """All options that features.toml knows."""
    return sorted(features.read_table()["options"])


def is_left(kind, name, removed):
    """True if something is in firmware without the removed options.

    kind: commands, responses, constants or enumerations.
    """
    clauses = features.read_table()[kind].get(name, ())
    return all(set(clause) - removed for clause in clauses)


def remove(table, removed):
    """The dictionary `table` as it is without some options."""
    removed = set(removed)
    result = dict(table)
    result["commands"] = {text: number for text, number in table["commands"].items()
                          if is_left("commands", text.split()[0], removed)}
    for key, kind in (("responses", "responses"), ("config", "constants"),
                      ("enumerations", "enumerations")):
        result[key] = {text: value for text, value in table[key].items()
                       if is_left(kind, text.split()[0], removed)}
    return result


def patch(monkeypatch, change, mcus=(0,)):
    """Have the mcus of these numbers, in the order in which they are identified, tell
    change(dictionary) of themselves."""
    load, seen = msgproto.load_dictionary, []

    def load_changed(data, is_compressed):
        table = load(data, is_compressed)
        seen.append(data)
        return change(table) if len(seen) - 1 in mcus else table

    monkeypatch.setattr(msgproto, "load_dictionary", load_changed)
