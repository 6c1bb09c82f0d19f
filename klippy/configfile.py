# SPDX-License-Identifier: GPL-3.0-or-later
"""The printer's config as its objects see it: typed, checked, tracked.

ConfigWrapper is one section; PrinterConfig is the printer object `configfile`.
Every error names file and line, the value and what would be right.
"""

import logging
import math

from klippy import configsave, dangers
from klippy.confignames import find_nearest, propose
from klippy.configtext import ConfigReader, shorten
from klippy.errors import ConfigError, collect

__all__ = ["ConfigWrapper", "PrinterConfig", "error", "get", "sentinel"]

error = ConfigError
_BOOLEANS = {"1": True, "yes": True, "true": True, "on": True,
             "0": False, "no": False, "false": False, "off": False}


class sentinel:
    """Default of an option that must be set."""


def parse_int(text):
    """A whole number.  Raises ValueError."""
    if "_" in text:
        raise ValueError(text)
    return int(text)


def parse_float(text):
    """A finite number.  Raises ValueError."""
    value = float(text)
    if not math.isfinite(value) or "_" in text:
        raise ValueError(text)
    return value


def parse_boolean(text):
    """True or False from the usual words.  Raises ValueError."""
    value = _BOOLEANS.get(text.strip().lower())
    if value is None:
        raise ValueError(text)
    return value


_WANTED = {parse_int: "a whole number", int: "a whole number",
           parse_float: "a finite number", float: "a finite number",
           parse_boolean: "True or False"}


def describe_range(minval, maxval, above, below):
    """Text for the range of a value."""
    limits = (("at least", minval), ("at most", maxval),
              ("above", above), ("below", below))
    return " and ".join("%s %s" % (word, limit)
                        for word, limit in limits if limit is not None)


class ConfigWrapper:
    """One section of the config, or the whole of it by getsection().

    default: what an option that is not set is; without it the option must be
    set.  note_valid=False reads without counting the option as known.
    """
    error = ConfigError

    def __init__(self, printer, fileconfig, access_tracking, section):
        self.printer = printer
        self.fileconfig = fileconfig
        self.access_tracking = access_tracking
        self.section = section

    def get_printer(self):
        """The Printer."""
        return self.printer

    def get_name(self):
        """Name of the section, with its second part if it has one."""
        return self.section

    # Values

    def _get_parsed(self, option, default, parser, note_valid, minval=None,
                    maxval=None, above=None, below=None):
        store = self.fileconfig
        if not store.has_option(self.section, option):
            if default is sentinel:
                raise self._missing(option)
            if note_valid:
                self._note(option, default)
            return default
        text = store.get(self.section, option)
        try:
            value = parser(text)
        except (ValueError, OverflowError):
            raise self.make_error(option, "'%s' is not %s" % (
                shorten(text), _WANTED.get(parser, "a valid value")))
        if ((minval is not None and value < minval)
                or (maxval is not None and value > maxval)
                or (above is not None and value <= above)
                or (below is not None and value >= below)):
            raise self.make_error(option, "'%s' must be %s" % (
                shorten(text), describe_range(minval, maxval, above, below)))
        if note_valid:
            self._note(option, value)
        return value

    def _note(self, option, value):
        self.access_tracking[(self.section.lower(), option.lower())] = value

    def _missing(self, option):
        store = self.fileconfig
        if not store.has_section(self.section):
            hint = "; the file is empty: restore it" if store.is_empty() else ""
            return ConfigError("section [%s] is missing: it must set '%s'%s"
                               % (self.section, option, hint), store.get_main_place(),
                               self.section, option)
        unread = [name for name in store.options(self.section)
                  if name not in store.asked.get(self.section, ())]
        nearest = find_nearest(option, unread)
        hint = "; is '%s' meant to be it?" % (nearest,) if nearest else ""
        return ConfigError("option '%s' in section [%s] must be set%s"
                           % (option, self.section, hint),
                           store.get_place(self.section), self.section, option, nearest)

    def make_error(self, option, text, nearest=None):
        """A ConfigError about an option of this section, with its place.

        nearest: the value that may have been meant.
        """
        place = self.fileconfig.get_place(self.section, option.lower())
        return ConfigError("option '%s' in section [%s]: %s"
                           % (option, self.section, text),
                           place.at_value() if place is not None else None,
                           self.section, option.lower(), nearest)

    def get(self, option, default=sentinel, note_valid=True):
        """Text of an option."""
        return self._get_parsed(option, default, str, note_valid)

    def getint(self, option, default=sentinel, minval=None, maxval=None,
               note_valid=True):
        """A whole number in minval..maxval."""
        return self._get_parsed(option, default, parse_int, note_valid, minval, maxval)

    def getfloat(self, option, default=sentinel, minval=None, maxval=None,
                 above=None, below=None, note_valid=True):
        """A finite number in the given range."""
        return self._get_parsed(option, default, parse_float, note_valid,
                                minval, maxval, above, below)

    def getboolean(self, option, default=sentinel, note_valid=True):
        """True for 1, yes, true, on; False for 0, no, false, off."""
        return self._get_parsed(option, default, parse_boolean, note_valid)

    def getchoice(self, option, choices, default=sentinel, note_valid=True):
        """What choices (a dict by text or whole number, or a list) has for it.

        default may be a key of choices too.
        """
        if not isinstance(choices, dict):
            choices = {choice: choice for choice in choices}
        is_number = bool(choices) and all(isinstance(c, int) for c in choices)
        key = self._get_parsed(option, default, parse_int if is_number else str,
                               note_valid)
        if key not in choices:
            if not self.fileconfig.has_option(self.section, option):
                return default
            raise self.make_error(option, "'%s' is not one of %s%s" % (
                shorten(str(key)), ", ".join("'%s'" % (c,) for c in choices),
                propose(str(key), choices)), find_nearest(str(key), choices))
        return choices[key]

    def getlists(self, option, default=sentinel, seps=(",",), count=None, parser=str,
                 note_valid=True):
        """Nested tuples; seps from the innermost separator to the outermost.

        count: length of the innermost tuples.
        """
        parser = {int: parse_int, float: parse_float}.get(parser, parser)

        def split(text, level):
            parts = [part.strip() for part in text.split(seps[level])]
            if level:
                return tuple(split(part, level - 1) for part in parts if part)
            if not parts[len(parts) - 1]:
                parts.pop()
            if count is not None and len(parts) != count:
                raise self.make_error(option, "'%s' has %d elements, it must have %d"
                                      % (shorten(text), len(parts), count))
            return tuple(self._parse_element(option, part, parser) for part in parts)

        def split_all(text):
            return split(text, len(seps) - 1)

        return self._get_parsed(option, default, split_all, note_valid)

    def _parse_element(self, option, text, parser):
        try:
            return parser(text)
        except (ValueError, OverflowError):
            raise self.make_error(option, "element '%s' is not %s" % (
                shorten(text), _WANTED.get(parser, "a valid value")))

    def getlist(self, option, default=sentinel, sep=",", count=None, note_valid=True):
        """A tuple of texts."""
        return self.getlists(option, default, (sep,), count, str, note_valid)

    def getintlist(self, option, default=sentinel, sep=",", count=None,
                   note_valid=True):
        """A tuple of whole numbers."""
        return self.getlists(option, default, (sep,), count, parse_int, note_valid)

    def getfloatlist(self, option, default=sentinel, sep=",", count=None,
                     note_valid=True):
        """A tuple of finite numbers."""
        return self.getlists(option, default, (sep,), count, parse_float, note_valid)

    # Sections

    def getsection(self, section):
        """Another section, which need not exist."""
        return ConfigWrapper(self.printer, self.fileconfig, self.access_tracking,
                             section)

    def has_section(self, section):
        """Whether the config has a section."""
        return self.fileconfig.has_section(section)

    def get_prefix_sections(self, prefix):
        """All sections whose names start with prefix."""
        return [self.getsection(name) for name in self.fileconfig.sections()
                if name.startswith(prefix)]

    def get_prefix_options(self, prefix):
        """Names of this section's options that start with prefix."""
        return [name for name in self.fileconfig.options(self.section)
                if name.startswith(prefix)]

    def deprecate(self, option, value=None):
        """Warn if an option (or one value of it) is used that will go away."""
        if not self.fileconfig.has_option(self.section, option):
            return
        text = self.fileconfig.get(self.section, option)
        if value is not None and text.strip().lower() != str(value).lower():
            return
        self.printer.lookup_object("configfile").deprecate(self.section, option, value)


class PrinterConfig:
    """Reads the config, keeps its status and the values to be saved."""

    def __init__(self, printer):
        self.printer = printer
        self.access_tracking = {}
        self.warnings = []
        self.raw_config, self.settings = {}, {}
        self.store = None               # ConfigStore of the main file
        self.save = configsave.ConfigSaver(printer)
        gcode = printer.lookup_object("gcode", None)
        if gcode is not None:
            gcode.register_command("SAVE_CONFIG", self.save.cmd_SAVE_CONFIG,
                                   desc=self.save.cmd_SAVE_CONFIG_help)

    def read_config(self, filename):
        """Read any config file; returns a ConfigWrapper of section `printer`."""
        store = ConfigReader().read(filename)
        return ConfigWrapper(self.printer, store, {}, "printer")

    def read_main_config(self):
        """Read the printer's config file, as read_config().

        start_args["implicit_sections"] ({section: {option: value}}) are added
        where the file lacks them.
        """
        start_args = self.printer.get_start_args()
        store = ConfigReader().read(start_args["config_file"])
        self.store = store
        implicit = start_args.get("implicit_sections", {})
        for section, options in implicit.items():
            if section in store.sections():
                continue
            store.add_section(section)
            for option, value in options.items():
                store.set(section, option, value)
        for text, section, option in store.warnings:
            logging.warning("config: %s", text)
            self._warn("config", text, section=section, option=option)
        self.save.note_saved(store)
        self.raw_config = {section: dict(store.items(section))
                           for section in store.sections()}
        return ConfigWrapper(self.printer, store, self.access_tracking, "printer")

    def get_place(self, section, option):
        """Place of an option of the main config, None if it is in no file."""
        return self.store.get_place(section, option) if self.store else None

    def log_config(self, config):
        """Log the values in use, and again in each new log file."""
        lines = ["===== Config ====="]
        for section, options in self.raw_config.items():
            lines.append("[%s]" % (section,))
            lines.extend("%s = %s" % (name, value.replace("\n", "\n\t"))
                         for name, value in options.items())
            lines.append("")
        lines.append("==================")
        self.printer.set_rollover_info(
            "config", "\n".join(lines),
            log=dangers.get(self.printer).log_config_file_at_startup)

    def replace_sections(self, prefix, sections):
        """Sections whose names start with prefix were read again from the files.

        sections: {name: ConfigWrapper}, all of them.
        """
        self.raw_config = {name: options for name, options in self.raw_config.items()
                           if not name.startswith(prefix)}
        for key in [key for key in self.access_tracking if key[0].startswith(prefix)]:
            del self.access_tracking[key]
        for name, section in sections.items():
            self.raw_config[name] = dict(section.fileconfig.items(name))
            self.access_tracking.update(section.access_tracking)
        self._build_settings()

    # Options nobody knows

    def check_unused_options(self, config, skipped=(), known_sections=(),
                             reasons=None):
        """Raise ConfigError for the options and sections nobody asked for.

        With error_on_unused_config_options off they are warnings.
        skipped: sections that could not be loaded.  known_sections: names to
        propose for unknown sections.  reasons: better texts by section.
        """
        store, errors = config.fileconfig, []
        objects = dict(self.printer.lookup_objects())
        read = {}
        for section, option in self.access_tracking:
            read.setdefault(section, set()).add(option)
        for section in store.sections():
            if section in skipped:
                continue
            known = read.get(section.lower(), ())
            if not known and section not in objects:
                if not self._is_all_saved(store, section):
                    errors.append(self._unknown_section(
                        store, section, known_sections, reasons or {}))
                continue
            errors.extend(self._unknown_option(store, section, option)
                          for option in store.options(section)
                          if option not in known
                          and (section, option) not in store.referenced
                          and not store.is_saved(section, option))
        self._build_settings()
        if errors and dangers.get(self.printer).error_on_unused_config_options:
            raise collect(errors)
        for err in errors:
            logging.warning("config: %s", err)
            self._warn("config", str(err), section=err.section, option=err.option)

    @staticmethod
    def _is_all_saved(store, section):
        options = store.options(section)
        return bool(options) and all(store.is_saved(section, o) for o in options)

    @staticmethod
    def _unknown_section(store, section, known, reasons):
        text, nearest = reasons.get(section), None
        if text is None and section in known:
            text = "section [%s] is used by nothing in this config" % (section,)
        if text is None:
            known = set(known) | {name for name in store.asked if name != section}
            nearest = find_nearest(section, known)
            text = "there is no section kind [%s]%s" % (
                section, propose(section, known, "[%s]")
                or ": remove it, or install the plug-in that has it")
        return ConfigError(text, store.get_place(section), section, nearest=nearest)

    @staticmethod
    def _unknown_option(store, section, option):
        known = [name for name in store.asked.get(section, ())
                 if not store.has_option(section, name)]
        return ConfigError("section [%s] has no option '%s'%s" % (
            section, option, propose(option, known) or ": remove it"),
            store.get_place(section, option), section, option,
            find_nearest(option, known))

    # Status

    def _build_settings(self):
        settings = {}
        for (section, option), value in self.access_tracking.items():
            settings.setdefault(section, {})[option] = value
        self.settings = settings

    def _warn(self, kind, message, **fields):
        entry = {"type": kind, "message": message}
        entry.update((k, v) for k, v in fields.items() if v is not None)
        if entry not in self.warnings:
            self.warnings = [*self.warnings, entry]

    def deprecate(self, section, option, value=None, msg=None):
        """Add a warning about an option that will go away."""
        if value is None:
            kind, text = "deprecated_option", "Option '%s' in section '%s'" % (
                option, section)
        else:
            kind, text = "deprecated_value", "Value '%s' of option '%s' in '%s'" % (
                value, option, section)
        text = msg or text + " is deprecated: it will not work in a later version"
        logging.warning(text)
        self._warn(kind, text, section=section, option=option, value=value)

    def runtime_warning(self, msg):
        """Add a warning that was found while running."""
        logging.warning(msg)
        self._warn("runtime_warning", msg)

    def get_status(self, eventtime):
        """config, settings, warnings and what SAVE_CONFIG would write."""
        return {"config": self.raw_config, "settings": self.settings,
                "warnings": self.warnings,
                "save_config_pending": self.save.is_pending,
                "save_config_pending_items": self.save.pending_items}

    def set(self, section, option, value):
        """Have SAVE_CONFIG write a value."""
        self.save.set(section, option, value)

    def remove_section(self, section):
        """Have SAVE_CONFIG remove what it wrote into a section before."""
        self.save.remove_section(section)


def get(printer):
    """The printer's PrinterConfig."""
    return printer.lookup_object("configfile")


