# SPDX-License-Identifier: GPL-3.0-or-later
"""Text of config files: sections, options, comments, includes, saved values.

All errors of all files are collected and raised together.  A `#` starts a
comment anywhere, a `;` at the start of a line or after a blank.  A line that is
indented deeper than its option continues the option's value.
"""

import codecs
import errno
import json
import os
import re

from klippy.errors import ConfigError, Place, collect

SAVE_MARK = "#*# <---------------------- SAVE_CONFIG ---------------------->"
SAVE_PREFIX = "#*#"
_HEADER = re.compile(r"\[(?P<name>[^\]]*)\]?(?P<rest>.*)", re.DOTALL)
_OPTION = re.compile(r"(?P<name>[^:=]*)[:=](?P<value>.*)", re.DOTALL)
# In SAVE_CONFIG's block: what the value above overrides, as SAVE_CONFIG saw it
_OVERRIDES = re.compile(r"#\*# # (?P<option>\S+) overrides (?P<value>\".*\")$")
_SEMICOLON = re.compile(r"(?:^|\s);")
_READ_REMEDIES = {
    errno.EACCES: ": let the user that runs this program read it",
    errno.EISDIR: ": name a file in it", errno.ENOENT: ": create it",
    errno.ELOOP: ": put a file there instead of the link"}
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
# Lines of one file with errors, behind which it is taken for another kind of file
_MAX_ERRORS = 20
_GLOB_SIGNS = re.compile(r"[*?\[]")


def shorten(text, limit=60):
    """Text for a message: printable and not longer than limit."""
    shown = "".join(
        "\\x%02x" % (ord(char) - 0xdc00) if "\udc80" <= char <= "\udcff" else
        char.encode("unicode_escape").decode("ascii") for char in text[:limit + 1])
    return shown if len(shown) <= limit else shown[:limit - 3] + "..."


class Entry:
    """One option: its value, where it is, and whether SAVE_CONFIG wrote it.

    written: the value in the file, before references in it were replaced.
    """

    __slots__ = ("value", "place", "is_saved", "written")

    def __init__(self, value, place, is_saved=False):
        self.value = self.written = value
        self.place, self.is_saved = place, is_saved


class ConfigStore:
    """Sections and options of a printer, later ones over earlier ones.

    Names of sections keep their case, names of options are lower case.  asked
    holds, by section, the options that the program looked for.
    """

    def __init__(self):
        self._sections = {}
        self._places = {}
        self.path = None            # of the main file
        self.last_asked = ("", "")  # section and option
        self.warnings = []          # (text, section, option)
        # (section, option) -> value below the saved one, in an included file
        self.overridden, self.overridden_places = {}, {}
        self.asked = {}
        self.referenced = set()     # (section, option) that other values refer to

    # The part that plug-ins know

    def sections(self):
        """Names of all sections, in order of appearance."""
        return list(self._sections)

    def has_section(self, section):
        self.asked.setdefault(section, set())
        return section in self._sections

    def options(self, section):
        """Names of the options of a section; none if there is no such section."""
        return list(self._sections.get(section, ()))

    def has_option(self, section, option):
        """Whether the option is set; notes that somebody asked."""
        option = option.lower()
        self.asked.setdefault(section, set()).add(option)
        self.last_asked = section, option
        return option in self._sections.get(section, ())

    def get(self, section, option):
        """Value of an option.  Raises ConfigError if it is not set."""
        return self._find(section, option).value

    def get_written(self, section, option):
        """As get(), with the references that the file has."""
        return self._find(section, option).written

    def expand(self, section, option, value):
        """Replace the value of an option by that without references."""
        self._find(section, option).value = value

    def _find(self, section, option):
        entry = self._sections.get(section, {}).get(option.lower())
        if entry is None:
            raise ConfigError("There is no option '%s' in section [%s]"
                              % (option, section), self.get_place(section))
        return entry

    def items(self, section):
        """Pairs of option and value of a section."""
        return [(name, entry.value)
                for name, entry in self._sections.get(section, {}).items()]

    def add_section(self, section, place=None):
        """Make sure that a section exists."""
        self._sections.setdefault(section, {})
        if place is not None:
            self._places.setdefault(section, place)

    def set(self, section, option, value, place=None, is_saved=False):
        """Set an option, adding its section if need be."""
        self.add_section(section, place)
        self._sections[section][option.lower()] = Entry(value, place, is_saved)

    def remove_option(self, section, option):
        """Forget an option; True if it was set."""
        return self._sections.get(section, {}).pop(option.lower(), None) is not None

    def remove_section(self, section):
        """Forget a section; True if it was there."""
        return self._sections.pop(section, None) is not None

    # Places

    def locate(self, err, section):
        """Give an error of a section's module place and names it does not have."""
        asked, option = self.last_asked
        text = Exception.__str__(err)
        if err.place is None:
            err.place = (self.guess_place(text) if asked == section
                         else self.get_place(section))
        if err.section is None:
            err.section = section
        if err.option is None and asked == section == err.section and (
                option and option in text):
            err.option = option

    def get_place(self, section, option=None):
        """Place of an option or section; None if it is not from a file."""
        entry = self._sections.get(section, {}).get(option)
        return entry.place if entry is not None else self._places.get(section)

    def guess_place(self, text):
        """Place for an error without one: what the program looked for last.

        It is the option's if the text of the error names it, else the section's.
        """
        section, option = self.last_asked
        place = self.get_place(section, option if option in text else None)
        return place or self.get_main_place()

    def is_empty(self):
        """Whether the files have no section at all."""
        return not self._places

    def get_main_place(self):
        """The main file as a Place, None if nothing is from a file."""
        return Place(self.path) if self.path is not None else None

    def is_saved(self, section, option):
        """Whether SAVE_CONFIG wrote the option."""
        entry = self._sections.get(section, {}).get(option)
        return entry is not None and entry.is_saved


def strip_comment(line):
    """The line without comment and trailing blanks."""
    line = line.partition("#")[0]
    if ";" in line:
        match = _SEMICOLON.search(line)
        if match is not None:
            line = line[:match.start()]
    return line.rstrip()


def split_lines(text):
    """Lines without their ends; knows LF and CRLF."""
    lines = text.split("\n")
    if lines and not lines[-1]:
        lines.pop()
    return [line.removesuffix("\r") for line in lines] if "\r" in text else lines


def decode(data):
    """Text of a file's bytes; what is not UTF-8 stays as lone surrogates."""
    return data.decode("utf-8", "surrogateescape").removeprefix("\ufeff")


def describe_overridden(option, value):
    """Line of SAVE_CONFIG's block: the value of another file that it overrides."""
    return "%s # %s overrides %s" % (SAVE_PREFIX, option, json.dumps(value))


def read_overridden(lines):
    """{option: [values]} of a block's lines that describe_overridden() made."""
    found = {}
    for match in filter(None, map(_OVERRIDES.match, lines)):
        try:
            value = json.loads(match["value"])
        except ValueError:
            continue        # changed by hand: as if it was not there
        found.setdefault(match["option"], []).append(value)
    return found


def find_saved_block(lines):
    """Index of the first line of SAVE_CONFIG's block, None without one."""
    for index, line in enumerate(lines):
        if line.startswith(SAVE_MARK):
            return index
    return None


class FileParser:
    """Takes one file's lines apart; options go to `emit`, errors to `errors`.

    emit: object with begin_section(name, place) and add_option(section, name,
    value, place); include(pattern, place) for include lines.
    """

    def __init__(self, path, emit, errors, n_cut=0):
        """n_cut: characters that were cut off in front of each line."""
        self.path, self.emit, self.errors = path, emit, errors
        self.n_cut = n_cut
        self.section = None
        self.is_skipping = False        # after a header that is no header
        self.option, self.values, self.indent = None, [], 0
        self.option_place = None
        self.n_errors = 0

    def parse(self, lines, first_line=1):
        """Parse lines, the first of which has number first_line."""
        for number, line in enumerate(lines, first_line):
            if self.n_errors >= _MAX_ERRORS:
                self._fail("%d lines of this file are wrong, the others were not"
                           " looked at: is it a config file? If it was, restore it"
                           % (self.n_errors,), Place(self.path, number))
                break
            if self.option is not None and self._continue(line):
                continue
            column = self.n_cut + len(line) - len(line.lstrip()) + 1
            self._parse_line(line, Place(self.path, number, column))
        self.end_option()

    def _continue(self, line):
        """Take a line that plainly goes on with a value, as most of macros do."""
        text = line.strip()
        if not text:
            self.values.append("")
            return True
        if ("#" in line or ";" in line or "\0" in line or not line.isascii()
                or len(line) - len(line.lstrip()) <= self.indent):
            return False
        self.values.append(text)
        return True

    def _fail(self, text, place):
        self.n_errors += 1
        self.errors.append(ConfigError(text, place))

    def _parse_line(self, raw, place):
        line = strip_comment(raw)
        if not line:
            if self.option is not None:
                self.values.append("")
            return
        if not self._is_text(line, place):
            return
        text = line.lstrip()
        indent = len(line) - len(text)
        if self.option is not None and indent > self.indent:
            self.values.append(text)
        elif text[0] == "[":
            self._parse_header(text, place)
        else:
            self._parse_option(text, indent, place)

    def _is_text(self, line, place):
        if "\0" in line:
            self._fail("a NUL byte in '%s': take it out, or restore the file"
                       % (shorten(line),), place)
            return False
        if not line.isascii() and any("\ud800" <= c <= "\udfff" for c in line):
            self._fail("'%s' is not UTF-8: save the file as UTF-8"
                       % (shorten(line),), place)
            return False
        return True

    def _parse_header(self, text, place):
        self.end_option()
        name = _HEADER.match(text).group("name").strip()
        self.section, self.is_skipping = None, False
        if "]" not in text or not name:
            self.is_skipping = True
            self._fail("'%s' is not a section header: write [name]"
                       % (shorten(text),), place)
        elif name.split(None, 1)[0] == "include":
            self.emit.include(name[len("include"):].strip(), place)
        else:
            self.section = name
            self.emit.begin_section(name, place)

    def _parse_option(self, text, indent, place):
        self.end_option()
        match = _OPTION.match(text)
        name = match.group("name").strip().lower() if match else ""
        if not name:
            self._fail("'%s' is not an option: write name: value" % (shorten(text),),
                       place)
        elif self.section is None:
            if not self.is_skipping:
                self._fail("option '%s' is not in a section: write [name] above it"
                           % (shorten(name),), place)
        else:
            value = match.group("value")
            if value.strip():
                place.value_column = (place.column + match.start("value")
                                      + len(value) - len(value.lstrip()))
            self.option, self.indent, self.option_place = name, indent, place
            self.values = [value.strip()]

    def end_option(self):
        """Pass on the option whose value is complete now."""
        if self.option is not None:
            value = "\n".join(self.values).rstrip()
            self.emit.add_option(self.section, self.option, value, self.option_place)
            self.option = None


class ConfigReader:
    """Reads a main file with all it includes into a ConfigStore."""

    def __init__(self):
        self.store = ConfigStore()
        self.errors = []
        self.parsers = []               # of the files that are open, main first
        self.is_saved = self.has_references = False
        self.known = {}                 # what saved values are known to override
        self.first_in_file = {}         # (path, section, option) -> Place
        self.seen_in_file = set()

    def read(self, path):
        """Read the main file.  Raises ConfigError, or several in one."""
        self.store.path = str(path)
        text = self._read_text(path, None)
        if text is not None:
            lines = split_lines(text)
            self._read_main(str(path), lines)
        if self.has_references:
            from klippy import configrefs
            self.errors.extend(configrefs.expand(self.store))
        if self.errors:
            raise collect(self.errors)
        return self.store

    def _read_main(self, path, lines):
        start = find_saved_block(lines)
        self._parse(path, lines[:start])
        if start is None:
            return
        saved = []
        for number, line in enumerate(lines[start:], start + 1):
            if line.strip() and not line.startswith(SAVE_PREFIX):
                self.errors.append(ConfigError(
                    "'%s' is below the line SAVE_CONFIG wrote: move it above"
                    % (shorten(line),), Place(path, number)))
                line = ""
            saved.append(line[len(SAVE_PREFIX):].removeprefix(" "))
        self.is_saved, self.known = True, read_overridden(lines[start:])
        # the first line is the mark, the second a remark
        self._parse(path, [""] + [
            "" if "DO NOT EDIT" in line else line for line in saved[1:]], start + 1,
            len(SAVE_PREFIX) + 1)

    def _read_text(self, path, place):
        try:
            with open(path, "rb") as source:
                data = source.read()
            if not data.startswith(_UTF_16):
                self.has_references |= b"${" in data
                return decode(data)
            self.errors.append(ConfigError(
                "the file is in UTF-16: save it as UTF-8", Place(str(path), 1)))
        except OSError as err:
            self.errors.append(ConfigError(
                "unable to read the config file '%s': %s%s" % (
                    path, err.strerror, _READ_REMEDIES.get(err.errno, "")), place))
        return None

    def _parse(self, path, lines, first_line=1, n_cut=0):
        parser = FileParser(path, self, self.errors, n_cut)
        self.parsers.append(parser)
        parser.parse(lines, first_line)
        self.parsers.pop()

    # Called by the parser

    def begin_section(self, name, place):
        key = (place.path, name, self.is_saved)
        if key in self.seen_in_file:
            self.store.warnings.append((
                "%s: section [%s] was there already: its options are added to it"
                % (place, name), name, None))
        self.seen_in_file.add(key)
        self.store.add_section(name, place)

    def add_option(self, section, name, value, place):
        key = (place.path, section, name, self.is_saved)
        first = self.first_in_file.setdefault(key, place)
        old = self.store.get_place(section, name)
        if first is not place:
            self.store.warnings.append((
                "%s: option '%s' of section [%s] was set in line %d already: the last"
                " one counts" % (place, name, section, first.line), section, name))
        elif self.is_saved and name in self.store.options(section):
            self._note_overridden(section, name, old, place)
        self.store.set(section, name, value, place, self.is_saved)

    def _note_overridden(self, section, name, old, place):
        """A saved value (at place) overrides another one: warn if that is news."""
        value = self.store.get(section, name)
        if old.path != place.path:
            self.store.overridden[section, name] = value
            self.store.overridden_places[section, name] = old
            if value in self.known.get(name, ()):
                return
        self.store.warnings.append((
            "%s: option '%s' of section [%s] is overridden by the value that"
            " SAVE_CONFIG wrote (%s)" % (old, name, section, place), section, name))

    def include(self, pattern, place):
        """Read the files that an include line names, in order of name."""
        import glob
        full = pattern and os.path.normpath(os.path.join(
            os.path.dirname(place.path), os.path.expanduser(pattern)))
        names = sorted(glob.glob(full)) if pattern else []
        if not names and not (pattern and _GLOB_SIGNS.search(pattern)):
            self.errors.append(ConfigError(
                "[include %s]: there is no file '%s': correct the name or remove the"
                " line" % (pattern, full), place))
        for name in names:
            self._include_file(name, place)

    def _include_file(self, name, place):
        real = os.path.realpath(name)
        chain = [parser.path for parser in self.parsers]
        if any(os.path.realpath(path) == real for path in chain):
            self.errors.append(ConfigError(
                "[include] goes in a circle: %s: remove one of these lines" % (
                    " -> ".join([*map(str, chain), name]),), place))
            return
        text = self._read_text(name, place)
        if text is not None:
            self._parse(name, split_lines(text))
