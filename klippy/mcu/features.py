# SPDX-License-Identifier: GPL-3.0-or-later
"""What a firmware lacks, told so that a user knows what to do about it.

features.toml says which option of menuconfig each command, constant and enumeration
of the firmware needs; scripts/feature_table.py writes it from the sources.
"""

import functools
import os

TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "features.toml")
KINDS = {"command": "commands", "constant": "constants", "enumeration": "enumerations"}
FLASH = "flash it (klippy firmware flash)"
# What else helps, by option
WAYS_OUT = {"WANT_HARD_PWM": "or set hardware_pwm: False"}


@functools.cache
def read_table():
    """The tables of features.toml."""
    import tomllib
    with open(TABLE, "rb") as file:
        return tomllib.load(file)


def find_options(kind, name):
    """Lists of options of menuconfig, of each of which one is needed."""
    table = read_table()
    found = table.get(KINDS.get(kind), {}).get(name)
    return table["responses"].get(name, []) if found is None else found


def write_option(name):
    """Text for an option as the menu shows it."""
    return "'%s' (%s)" % (read_table()["options"][name], name)


def write_remedy(err):
    """What helps against a MissingError."""
    needed = [] if err.is_other else find_options(err.kind, err.name)
    if not needed:
        return ("build the firmware of this version, with 'make menuconfig' and 'make',"
                " and " + FLASH)
    texts = [" or ".join(write_option(name) for name in names) for names in needed]
    ways = [WAYS_OUT[names[0]] for names in needed if names[0] in WAYS_OUT]
    return ", ".join([
        "build it with %s, which 'make menuconfig' offers if its chip can, and %s"
        % (" and ".join(texts), FLASH), *ways])


def explain(mcu_name, err):
    """Text: what the firmware of an mcu lacks, and what helps."""
    if err.reason is None:
        lack = ("has another form of %s: %s" % (err.describe(), err) if err.is_other
                else "lacks %s" % (err.describe(),))
        err.reason = "the firmware of mcu '%s' %s; %s" % (
            mcu_name, lack, write_remedy(err))
    return err.reason
