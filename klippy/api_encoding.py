# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages of the API socket as bytes: JSON with an end mark."""

import json
import math

MESSAGE_END = b"\x03"
MAX_DEPTH = 50              # levels of a value that is not plain JSON


def encode_json(value):
    """JSON of a value as bytes; never fails on values."""
    try:
        text = _ENCODER.encode(value)
    except (TypeError, ValueError, RecursionError):
        text = _ENCODER.encode(_tame(value, ()))
    return text.encode("utf-8", "replace")


def encode_message(message):
    """JSON of a message as bytes, with its end mark; never fails on values."""
    return encode_json(message) + MESSAGE_END


def _encode_other(value):
    if isinstance(value, (set, frozenset)):
        return sorted(value, key=str)
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)


def _tame(value, path):
    """The value with null where JSON has no word for it: nan, too deep, endless.

    path: ids of the values around it.
    """
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if not isinstance(value, (dict, list, tuple)):
        return value
    if id(value) in path or len(path) >= MAX_DEPTH:
        return None
    path = (*path, id(value))
    if isinstance(value, dict):
        return {str(key): _tame(item, path) for key, item in value.items()}
    return [_tame(item, path) for item in value]


_ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False,
                            default=_encode_other)


class PushTemplate:
    """A client's response_template (dict), ready to get `params` many times."""

    def __init__(self, template):
        kept = {key: value for key, value in template.items() if key != "params"}
        start = encode_json(kept)[:-1]
        self.head = start + (b"," if kept else b"") + b'"params":'

    def make(self, params):
        """The message with params (encoded JSON)."""
        return b"".join((self.head, params, b"}", MESSAGE_END))
