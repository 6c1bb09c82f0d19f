# SPDX-License-Identifier: GPL-3.0-or-later
"""SAVE_CONFIG: writes calibration results to the end of the main config file.

The file is replaced in one step, so that a power cut leaves the old or the new
one; the old one stays as a dated backup.  Included files are never changed.
"""

import logging
import os

from klippy import dangers
from klippy.configtext import (
    SAVE_MARK,
    SAVE_PREFIX,
    FileParser,
    decode,
    describe_overridden,
    find_saved_block,
    split_lines,
)
from klippy.errors import CommandError

SAVE_REMARK = "#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated."


class OptionFinder:
    """Finds the lines of the options of one file."""

    def __init__(self, path, lines):
        self.starts = []                # (index, section, option), sections too
        parser = FileParser(path, self, [])
        parser.parse(lines)

    def begin_section(self, name, place):
        self.starts.append((place.line - 1, name, None))

    def add_option(self, section, name, value, place):
        self.starts.append((place.line - 1, section, name))

    def include(self, pattern, place):
        self.starts.append((place.line - 1, None, None))


def comment_out(path, lines, options):
    """The lines with some options (pairs of section and option) as comments."""
    finder = OptionFinder(path, lines)
    starts = sorted(finder.starts)
    ends = [start[0] for start in starts[1:]] + [len(lines)]
    result = list(lines)
    for (start, section, option), end in zip(starts, ends, strict=True):
        if option is None or (section, option) not in options:
            continue
        for index in range(start, end):
            text = lines[index]
            if index == start or (text[:1].isspace() and text.strip()):
                result[index] = "#" + text
            elif text.strip():
                break
    return result


def build_saved_block(saved, overridden):
    """Lines of the block for {section: {option: value}}; none if it is empty.

    overridden: {(section, option): value} of included files, kept as remarks.
    """
    if not saved:
        return []
    lines = [SAVE_MARK, SAVE_REMARK, SAVE_PREFIX]
    for section, options in saved.items():
        lines.append("%s [%s]" % (SAVE_PREFIX, section))
        for option, value in options.items():
            first, *more = value.split("\n")
            lines.append(("%s %s = %s" % (SAVE_PREFIX, option, first)).rstrip())
            lines.extend(("%s \t%s" % (SAVE_PREFIX, text)).rstrip() for text in more)
            if (section, option) in overridden:
                lines.append(describe_overridden(option, overridden[section, option]))
        lines.append(SAVE_PREFIX)
    return lines


def find_overridden(store, saved):
    """{(section, option): value} of the included files that saved values override."""
    found = {}
    for section, option in [(s, o) for s in saved for o in saved[s]]:
        place = store.get_place(section, option)
        if (section, option) in store.overridden:
            found[section, option] = store.overridden[section, option]
        elif (option in store.options(section) and place is not None
                and not store.is_saved(section, option) and place.path != store.path):
            found[section, option] = store.get_written(section, option)
    return found


def build_file(path, text, saved, overridden=None):
    """The new text of the main file: text with the saved values {section:
    {option: value}} in place of those it holds.

    overridden: see build_saved_block().
    """
    lines = split_lines(text)
    lines = lines[:find_saved_block(lines)]
    options = {(section, option) for section in saved for option in saved[section]}
    lines = comment_out(path, lines, options)
    while lines and not lines[-1].strip():
        lines.pop()
    block = build_saved_block(saved, overridden or {})
    newline = "\r\n" if "\r\n" in text else "\n"
    return newline.join(lines + ([""] + block if block else [])) + newline


def write_with_backup(path, text, now, backup=None):
    """Replace a file, keeping the old one as <name>-<date>_<time>.cfg.

    text: str as decode() gives it.  now: datetime of the backup's name.
    backup: pathlib.Path to keep it at instead.
    Raises OSError; the file is then what it was.
    """
    import pathlib
    path = pathlib.Path(path).resolve()
    stem = path.name.removesuffix(".cfg")
    # the name of one beside included files must not be one that is included
    temporary = path.with_name(("." if backup else "") + stem + "_autosave.cfg")
    backup = backup or path.with_name("%s-%s.cfg" % (stem, format_time(now)))
    old, status = path.read_bytes(), path.stat()
    try:
        _write_synced(backup, old)
        _write_synced(temporary, text.encode("utf-8", "surrogateescape"))
        os.chmod(temporary, status.st_mode & 0o7777)
        os.replace(temporary, path)
    except OSError:
        for unneeded in (temporary, backup):
            unneeded.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def format_time(now):
    """A datetime as names of backups have it."""
    return now.strftime("%Y%m%d_%H%M%S")


def _sync_folder(path):
    """Have the disk keep the new names too; both are good files if it does not."""
    try:
        folder = os.open(path, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(folder)
    except OSError as err:
        logging.warning("the folder '%s' was not synced: %s", path, err)
    finally:
        os.close(folder)


def _write_synced(path, data):
    with open(path, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


class ConfigSaver:
    """Values that were saved before and those that wait to be."""

    cmd_SAVE_CONFIG_help = "Write the calibration results to the config file, restart"

    def __init__(self, printer):
        self.printer = printer
        self.saved = {}
        self.store = None
        self.pending_items = {}
        self.is_pending = False

    def note_saved(self, store):
        """Take over what the config file's block holds."""
        self.saved, self.store = {}, store
        for section in store.sections():
            options = {option: store.get_written(section, option)
                       for option in store.options(section)
                       if store.is_saved(section, option)}
            if options:
                self.saved[section] = options

    def set(self, section, option, value):
        """Remember a value for the next SAVE_CONFIG."""
        option, value = option.lower(), str(value)
        self.saved.setdefault(section, {})[option] = value
        pending = dict(self.pending_items)
        pending[section] = {**(pending.get(section) or {}), option: value}
        self.pending_items, self.is_pending = pending, True
        logging.info("SAVE_CONFIG is to set [%s] %s = %s", section, option, value)

    def remove_section(self, section):
        """Forget what was saved or set for a section."""
        if self.saved.pop(section, None) is not None:
            self.pending_items = {**self.pending_items, section: None}
            self.is_pending = True

    def cmd_SAVE_CONFIG(self, gcmd):
        """Write the file and restart; without anything to save do nothing.

        RESTART=0: go on without a restart, for values that are in use already.
        """
        is_restart = gcmd.get_int("RESTART", 1, minval=0, maxval=1)
        if not self.is_pending:
            return
        import datetime
        path = self.printer.get_start_args()["config_file"]
        try:
            with open(path, "rb") as source:
                text = decode(source.read())
            new = build_file(path, text, self.saved,
                             find_overridden(self.store, self.saved))
            write_with_backup(path, new, datetime.datetime.now())
            if dangers.get(self.printer).autosave_includes:
                from klippy import configincludes
                configincludes.clean(self.store, self.saved, datetime.datetime.now())
        except OSError as err:
            raise CommandError("Unable to write the config file '%s': %s"
                               % (path, err.strerror))
        self.is_pending, self.pending_items = False, {}
        if is_restart:
            self.printer.lookup_object("gcode").run_script_from_command("RESTART")
