# SPDX-License-Identifier: GPL-3.0-or-later
"""Values to try: for options that must be set, and other ones than the default."""

import re

from klippy.configfile import sentinel

MAX_CHOICES = 40


def guess_required(read, number):
    """Text for an option that must be set and is not; number: to be unique."""
    if read.kind == "str":
        return "X%d" % (number,) if is_pin(read.option) else "sample"
    found = list_alternatives(read, None)
    return found[0] if found else ""


def is_pin(option):
    """Whether an option names a pin."""
    return option == "pin" or option.endswith("_pin")


def list_alternatives(read, now):
    """Texts worth a try for an option.  now: its text, None if it is not set."""
    default = None if read.default is sentinel else read.default
    if read.kind == "bool":
        return ["False"] if default else ["True"]
    if read.kind == "choice":
        shown = [str(choice) for choice in read.choices if choice != default]
        return [text for text in shown[:MAX_CHOICES] if text != now]
    if read.kind in ("int", "float"):
        value = pick_number(read, _as_number(now, default))
        return [] if value is None else ["%d" % value if read.kind == "int"
                                         else "%.10g" % value]
    if read.kind == "list":
        return [_write_list(read)]
    if now is not None and not is_pin(read.option):
        return []
    return [name_alike(read)]


def name_alike(read):
    """A name that no other section has."""
    return re.sub(r"[^a-z0-9]", "", read.section.lower()) + "_" + read.option


def _as_number(now, default):
    for value in (now, default):
        try:
            return float(value)
        except (TypeError, ValueError):
            pass
    return None


def pick_number(read, avoid):
    """A number within the range of a read that is not the one to avoid."""
    low = _first(read.minval, read.above)
    high = _first(read.maxval, read.below)
    if low is not None and high is not None:
        candidates = [low + (high - low) * share for share in (.5, .25, .75)]
        if read.kind == "int":
            candidates = [round(value) for value in candidates] + [low, high]
    elif low is not None:
        candidates = [(avoid or 0.) * 1.5, low + 1., low + 4.]
    elif high is not None:
        candidates = [high - 1., high - 4.]
    else:
        candidates = [(avoid or 0.) * 1.25, 1., 2.]
    for value in candidates:
        if value != avoid and _is_within(read, value) and (
                read.kind == "float" or value == int(value)):
            return value
    return None


def _first(*values):
    return next((value for value in values if value is not None), None)


def _is_within(read, value):
    return ((read.minval is None or value >= read.minval)
            and (read.maxval is None or value <= read.maxval)
            and (read.above is None or value > read.above)
            and (read.below is None or value < read.below))


def _write_list(read):
    element = {"int": "1", "float": "1", "str": "sample"}[read.item]
    inner = read.seps[0] if read.seps else ","
    return inner.join([element] * (read.count or 1))
