# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the commands of a data dictionary as a C table, for the fuzzer.

    python write_formats.py klipper.dict fuzz_formats.h
"""

import json
import pathlib
import sys

KINDS = {"%c": "FORMAT_BYTE", "%hu": "FORMAT_SHORT", "%hi": "FORMAT_SIGNED",
         "%u": "FORMAT_LONG", "%i": "FORMAT_LONG", "%*s": "FORMAT_BYTES",
         "%.*s": "FORMAT_BYTES"}


def choose_kind(name, kind):
    """What values a parameter is given: by its name, else by its type."""
    if name == "oid" or name.endswith("_oid"):
        return "FORMAT_OID"
    if name == "clock" or name.endswith("_clock"):
        return "FORMAT_CLOCK"
    if name == "pin" or name.endswith("_pin"):
        return "FORMAT_PIN"
    return KINDS[kind]


def write_formats(dictionary):
    """The table as C text."""
    rows, most = [], 0
    for text, number in sorted(dictionary["commands"].items(), key=lambda c: c[1]):
        name, *params = text.split()
        kinds = [choose_kind(*param.split("=")) for param in params]
        most = max(most, len(kinds))
        rows.append("    { %d, %d, { %s } }, /* %s */"
                    % (number, len(kinds), ", ".join(kinds) or "0", name))
    return "\n".join(["/* Generated. */", "enum { FORMAT_MAX_PARAMS = %d };" % most,
                      "static const struct format {",
                      "    uint16_t id;", "    uint8_t n_params;",
                      "    uint8_t kinds[FORMAT_MAX_PARAMS];", "} formats[] = {",
                      *rows, "};", ""])


if __name__ == "__main__":
    pathlib.Path(sys.argv[2]).write_text(
        write_formats(json.loads(pathlib.Path(sys.argv[1]).read_text())))
