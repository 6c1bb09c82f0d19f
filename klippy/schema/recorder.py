# SPDX-License-Identifier: GPL-3.0-or-later
"""A config that notes each option a module asks for, with its type and range."""

import sys
from typing import NamedTuple

from klippy.configfile import ConfigWrapper, sentinel

__all__ = ["Read", "Recorder", "RecordingConfig"]

# Frames of these modules are not who asks
_OWN_MODULES = {__name__, "klippy.configfile"}
_LOADER = "klippy.printer"
_KINEMATICS = "klippy.kinematics."


class Read(NamedTuple):
    """One question of a module to its section.

    kind: str, int, float, bool, choice or list.  default: sentinel if the option
    must be set.  item: of a list, the type of its elements.  modules: who asked,
    innermost first.
    """
    section: str
    option: str
    kind: str
    default: object
    minval: object = None
    maxval: object = None
    above: object = None
    below: object = None
    choices: tuple = ()
    item: str = "str"
    seps: tuple = ()
    count: int | None = None
    modules: tuple = ()


class Recorder:
    """Collects the reads of one load of a printer.

    supply(read) -> text for an option that must be set and is not, or None.
    """

    def __init__(self, supply):
        self.supply = supply
        self.reads = []
        self.prefixes = set()           # (section, prefix of options)
        self.deprecated = set()         # (section, option)

    def note(self, config, read):
        """A module reads an option; an option it needs is made up if not set."""
        read = read._replace(modules=find_readers())
        self.reads.append(read)
        store = config.fileconfig
        if read.default is sentinel and not store.has_option(read.section, read.option):
            text = self.supply(read)
            if text is not None:
                store.set(read.section, read.option, text)


def find_readers():
    """Names of the modules on the stack up to the loader, innermost first.

    All kinematics count as one reader; compiled they would not be seen anyway.
    """
    names, frame = [], sys._getframe(2)
    while frame is not None:
        name = frame.f_globals.get("__name__", "")
        if name == _LOADER:
            break
        if (name not in _OWN_MODULES and name not in names
                and not name.startswith(_KINEMATICS)):
            names.append(name)
        frame = frame.f_back
    return tuple(name.rpartition(".")[2] for name in names)


class RecordingConfig(ConfigWrapper):
    """A ConfigWrapper whose readers are watched by its recorder."""

    recorder = None

    def _watch(self, note_valid, option, kind, default, **details):
        if note_valid:
            self.recorder.note(self, Read(self.section, option.lower(), kind, default,
                                          **details))

    def get(self, option, default=sentinel, note_valid=True):
        self._watch(note_valid, option, "str", default)
        return super().get(option, default, note_valid)

    def getint(self, option, default=sentinel, minval=None, maxval=None,
               note_valid=True):
        self._watch(note_valid, option, "int", default, minval=minval, maxval=maxval)
        return super().getint(option, default, minval, maxval, note_valid)

    def getfloat(self, option, default=sentinel, minval=None, maxval=None,
                 above=None, below=None, note_valid=True):
        self._watch(note_valid, option, "float", default, minval=minval,
                    maxval=maxval, above=above, below=below)
        return super().getfloat(option, default, minval, maxval, above, below,
                                note_valid)

    def getboolean(self, option, default=sentinel, note_valid=True):
        self._watch(note_valid, option, "bool", default)
        return super().getboolean(option, default, note_valid)

    def getchoice(self, option, choices, default=sentinel, note_valid=True):
        self._watch(note_valid, option, "choice", default, choices=tuple(choices))
        return super().getchoice(option, choices, default, note_valid)

    def getlists(self, option, default=sentinel, seps=(",",), count=None, parser=str,
                 note_valid=True):
        item = {"parse_int": "int", "int": "int", "parse_float": "float",
                "float": "float"}.get(getattr(parser, "__name__", ""), "str")
        self._watch(note_valid, option, "list", default, seps=tuple(seps),
                    count=count, item=item)
        return super().getlists(option, default, seps, count, parser, note_valid)

    def getsection(self, section):
        config = RecordingConfig(self.printer, self.fileconfig, self.access_tracking,
                                 section)
        config.recorder = self.recorder
        return config

    def get_prefix_options(self, prefix):
        self.recorder.prefixes.add((self.section, prefix))
        return super().get_prefix_options(prefix)

    def deprecate(self, option, value=None):
        if value is None:
            self.recorder.deprecated.add((self.section, option))
        super().deprecate(option, value)
