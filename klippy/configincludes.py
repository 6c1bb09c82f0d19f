# SPDX-License-Identifier: GPL-3.0-or-later
"""SAVE_CONFIG with autosave_includes: saved options become comments in included files.

The files as they were are kept in config_backups/ beside the main file.
"""

import os
import pathlib

from klippy.configsave import comment_out, format_time, write_with_backup
from klippy.configtext import decode, split_lines

BACKUP_FOLDER = "config_backups"


def find_included(store, saved):
    """{path: {(section, option)}} of the included files that have saved options."""
    found = {}
    for key in [(section, option) for section in saved for option in saved[section]]:
        section, option = key
        place = store.overridden_places.get(key)
        if place is None and option in store.options(section):
            place = store.get_place(section, option)
        if place is not None and place.path != store.path:
            found.setdefault(place.path, set()).add(key)
    return found


def clean(store, saved, now):
    """Comment out what is saved in all included files.  Raises OSError.

    saved: {section: {option: value}}.  now: datetime of the backups' names.
    """
    root = pathlib.Path(store.path).resolve().parent
    for path, options in find_included(store, saved).items():
        with open(path, "rb") as source:
            text = decode(source.read())
        newline = "\r\n" if "\r\n" in text else "\n"
        lines = comment_out(path, split_lines(text), options)
        folder = root / BACKUP_FOLDER
        folder.mkdir(exist_ok=True)
        name = os.path.relpath(os.path.realpath(path), root).removesuffix(".cfg")
        name = "%s-%s.cfg" % (name.replace("..", "").strip(os.sep).replace(os.sep, "_"),
                              format_time(now))
        write_with_backup(path, newline.join(lines) + newline, now, folder / name)
