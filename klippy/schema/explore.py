# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the loaders of a config again and again, each time with another option set.

A room is a printer that loads; its targets are the sections that are explored.
An option that a section asks for is set to other values in later loads, alone
first, so that it shows which options depend on it.
"""

import logging
from typing import NamedTuple

from klippy.configfile import sentinel
from klippy.configtext import ConfigReader, ConfigStore
from klippy.errors import ConfigError
from klippy.printer import Printer, SectionLoader
from klippy.reactor import Reactor
from klippy.schema.recorder import Recorder, RecordingConfig
from klippy.schema.values import guess_required, list_alternatives
from klippy_ext.vworld import VirtualWorld

MAX_DEPTH = 3               # options set at a time beside what must be set


class Trial(NamedTuple):
    """What a section asked for in one load.

    given: {option: text} set on purpose.  texts: all that was set.
    reads: {option: last Read}.
    """
    section: str
    given: dict
    texts: dict
    reads: dict
    is_loaded: bool


class Target:
    """A section under exploration."""

    def __init__(self, section, max_depth):
        self.section, self.max_depth = section, max_depth
        self.queue = [{}]
        self.trials = []
        self.known = set()          # options that were asked for
        self.prefixes, self.deprecated = set(), set()

    def note(self, given, reads, is_loaded, store):
        """Keep a load's findings, and plan loads with the options it showed."""
        texts = dict(store.items(self.section))
        self.trials.append(Trial(self.section, given, texts, reads, is_loaded))
        for option, read in reads.items():
            if option in self.known:
                continue
            self.known.add(option)
            if len(given) >= self.max_depth:
                continue
            now = texts.get(option)
            self.queue.extend({**given, option: text}
                              for text in list_alternatives(read, now))


class Room:
    """A printer of some sections, and the exploration of part of them."""

    def __init__(self, name, store, sections, max_depth=MAX_DEPTH):
        self.name, self.store = name, store
        self.targets = [Target(section, max_depth) for section in sections]
        self.supplied = {}          # (section, option) -> text
        self.errors = {}            # section -> why its first load failed

    def explore(self):
        """Load until there is nothing left to try.

        [printer] is explored alone: what others take from it must be known.
        """
        alone = [target for target in self.targets if target.section == "printer"]
        others = [target for target in self.targets if target not in alone]
        self._explore_targets(alone)
        self._explore_targets(others)

    def _explore_targets(self, targets):
        while any(target.queue for target in targets):
            batch = [(target, target.queue.pop(0))
                     for target in targets if target.queue]
            if not self._try(batch):
                # what failed may have kept others from being loaded
                for target, given in batch:
                    self._try([(target, given)], is_last=True)

    def supply(self, read):
        """Text for an option that must be set."""
        key = read.section, read.option
        if key not in self.supplied:
            self.supplied[key] = guess_required(read, len(self.supplied))
        return self.supplied[key]

    def _try(self, batch, is_last=False):
        """One load; False if the whole of it failed and nothing was noted."""
        store = copy_store(self.store)
        for target, given in batch:
            for option, text in given.items():
                store.set(target.section, option, text)
        recorder = Recorder(self.supply)
        failed, is_whole = load(store, recorder)
        if not is_whole and not is_last and len(batch) > 1:
            return False
        for target, given in batch:
            reads = combine(read for read in recorder.reads
                            if read.section == target.section)
            is_loaded = is_whole and target.section not in failed
            if not given and not is_loaded:
                self.errors[target.section] = failed.get(
                    target.section, failed.get("", "?"))
            target.prefixes |= {prefix for section, prefix in recorder.prefixes
                                if section == target.section}
            target.deprecated |= {option for section, option in recorder.deprecated
                                  if section == target.section}
            target.note(given, reads, is_loaded, store)
        return True


def combine(reads):
    """{option: Read}; of several the last, which knows most.

    If the first has no default, what the last has is computed.
    """
    found = {}
    for read in reads:
        first = found.get(read.option)
        if (first is not None and first.default is None and first.kind == read.kind
                and read.default is not sentinel):
            read = read._replace(default=None)
        found[read.option] = read
    return found


class Loader(SectionLoader):
    """Loads all, but does not look for options that nobody read."""

    def _check_unused(self, config, is_begun):
        pass


def copy_store(store):
    """A ConfigStore of the same sections and values."""
    copy = ConfigStore()
    for section in store.sections():
        copy.add_section(section)
        for option, value in store.items(section):
            copy.set(section, option, value)
    return copy


def load(store, recorder):
    """Load a printer.  Returns ({section: error}, whether the core loaded too)."""
    printer, failed = try_load(store, recorder)
    printer.send_event("klippy:disconnect")
    printer.get_reactor().finalize()
    return failed, not failed.get("")


def load_printer(store, supply):
    """The Printer of a config, with supply(read) -> text for what must be set."""
    return try_load(copy_store(store), Recorder(supply))[0]


def try_load(store, recorder):
    """(Printer, {section: error}); errors of the core are those of section ""."""
    reactor = Reactor(VirtualWorld())
    printer = Printer(reactor, None, {
        "config_file": "", "debugoutput": "/dev/null", "dictionary": {},
        "start_reason": "check"})
    configfile = printer.lookup_object("configfile")
    configfile.store = store
    configfile.raw_config = {section: dict(store.items(section))
                             for section in store.sections()}
    config = RecordingConfig(printer, store, configfile.access_tracking, "printer")
    config.recorder = recorder
    failed, loader = {}, Loader(printer)
    printer.loader = loader
    try:
        loader.load_all(config)
    except ConfigError:
        known = list(loader.failed.values())
        failed[""] = "\n".join(str(err) for err in loader.errors
                               if not any(err is other for other in known))
    except Exception as err:
        # a value that nobody should set is no reason to end
        logging.info("a loader failed on unusual values", exc_info=err)
        failed[""] = "%s: %s" % (type(err).__name__, err)
    failed.update((section, str(err)) for section, err in loader.failed.items())
    return printer, failed


def read_store(path, base=None):
    """The ConfigStore of a file, its sections put over those of a base."""
    store = ConfigReader().read(str(path))
    if base is None:
        return store
    merged = copy_store(base)
    for section in store.sections():
        merged.remove_section(section)
        merged.add_section(section)
        for option, value in store.items(section):
            merged.set(section, option, value)
    return merged
