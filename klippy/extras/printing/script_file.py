# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts in files of their own: `gcode: !!include park.gcode` in the config."""

import os

INCLUDE = "!!include"


def read_script(config, option, text):
    """The G-code that an option names.  Raises ConfigError.

    The file is looked for beside the one that has the option.
    """
    words = text.strip().split(None, 1)
    if words[0] != INCLUDE or len(words) < 2 or "\n" in words[1]:
        raise config.make_error(option, (
            "'%s' is no G-code: lines of Python that begin with '!' are not known here,"
            " only '%s FILE'" % (text.strip().split("\n")[0], INCLUDE)))
    place = config.fileconfig.get_place(config.get_name(), option)
    folder = os.path.dirname(place.path) if place is not None else ""
    path = os.path.join(folder, os.path.expanduser(words[1]))
    if path.endswith(".py"):
        raise config.make_error(
            option, "'%s' is in Python: only files of G-code can be included" % (path,))
    try:
        with open(path, encoding="utf-8") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as err:
        raise config.make_error(option, "unable to read '%s': %s" % (
            path, getattr(err, "strerror", None) or "it is not UTF-8"))
