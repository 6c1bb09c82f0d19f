# SPDX-License-Identifier: GPL-3.0-or-later
"""What a section has of an mcu: absent with the mcu, or as its firmware lacks it.

All that a section sets up on an mcu while it is loaded is one Part, which is there
as a whole or not at all.  A section whose module says MAY_LACK_FIRMWARE = True does
without; any other keeps the printer from starting.  Objects that serve several
sections, and options that a section can do without, have parts of their own.
"""

import logging

from klippy.errors import McuError
from klippy.mcu import features


class LackError(McuError):
    """The printer must not run without what the firmware of an mcu lacks."""


class Part:
    """Some objects of one mcu, for the sections `users` (LoadedSection).

    what: text for it, where it is less than all that its section has.
    """

    def __init__(self, mcu, users=(), what=None, may_lack=False):
        self._mcu, self._what, self._may_lack = mcu, what, may_lack
        self.users = list(users)
        # Why its commands fail: None, or a text
        self.lack = None

    @property
    def non_critical_disconnected(self):
        """True while it cannot be used."""
        return self.lack is not None or self._mcu.non_critical_disconnected

    def get_name(self):
        """Name of the mcu."""
        return self._mcu.get_name()

    def register_config_callback(self, callback):
        """As that of the mcu, for this part."""
        self._mcu.register_config_callback(callback, self)

    def add_user(self):
        """Another section, that which is loaded, has a share in it."""
        user = find_user(self._mcu.get_printer())
        if user is not None and user not in self.users:
            self.users.append(user)

    def is_whole(self):
        """True if it is all that its sections have."""
        return self._what is None

    def note_lack(self, err):
        """The firmware lacks something of it, as a MissingError says."""
        reason = features.explain(self._mcu.get_name(), err)
        names = self.describe()
        if not self.is_needed():
            self.lack = "%s cannot be used: %s" % (names, reason)
        elif names:
            self.lack = "The printer cannot run without %s: %s" % (names, reason)
        else:
            self.lack = reason[:1].upper() + reason[1:]

    def is_needed(self):
        """True if the printer must not run without it."""
        return not self._may_lack and not (
            self.users and all(user.may_lack for user in self.users))

    def describe(self):
        """Text: the sections and where they are."""
        printer = self._mcu.get_printer()
        config = printer.lookup_object("configfile", None)
        texts = []
        for user in self.users:
            place = config.get_place(user.name, None) if config else None
            texts.append("[%s]%s" % (user.name, " at %s" % (place,) if place else ""))
        names = " and ".join(texts)
        return "%s of %s" % (self._what, names) if self._what else names


def find_user(printer):
    """The LoadedSection that is being loaded; None at other times."""
    find_loading = getattr(printer, "find_loading", None)
    return None if find_loading is None else find_loading()


class Parts:
    """The parts of one mcu, and what is told of those that cannot be used."""

    def __init__(self, mcu):
        self._mcu = mcu
        self._by_section = {}
        self._parts = []
        self._told, self._unsaid = set(), []

    def get(self):
        """The Part of the section that is being loaded."""
        user = find_user(self._mcu.get_printer())
        part = self._by_section.get(user)
        if part is None:
            part = self._by_section[user] = self.make()
        return part

    def make(self, what=None, may_lack=False):
        """A new Part of its own for the section that is being loaded."""
        user = find_user(self._mcu.get_printer())
        part = Part(self._mcu, [] if user is None else [user], what, may_lack)
        self._parts.append(part)
        return part

    def reset(self):
        """Forget what is lacking: the firmware is looked at anew."""
        for part in self._parts:
            part.lack = None

    def tell(self):
        """Warn of what is lacking, and have the commands of its sections fail.

        Raises LackError, with all that is needed.
        """
        needed = [part.lack for part in self._parts
                  if part.lack is not None and part.is_needed()]
        if needed:
            raise LackError("\n".join(needed))
        printer = self._mcu.get_printer()
        for part in self._parts:
            if part.lack is None or part.lack in self._told:
                continue
            self._told.add(part.lack)
            self._unsaid.append(part.lack)
            config = printer.lookup_object("configfile", None)
            if config is None:
                logging.warning("%s", part.lack)
            else:
                config.runtime_warning(part.lack)
            if part.is_whole():
                gcode = printer.lookup_object("gcode")
                for user in part.users:
                    gcode.block_section(user.name, part.lack)
        if printer.get_state_message()[1] == "ready":
            self.say()

    def say(self):
        """Tell the console what it was not told yet."""
        gcode = self._mcu.get_printer().lookup_object("gcode")
        for text in self._unsaid:
            gcode.respond_info("Warning: " + text, log=False)
        self._unsaid = []
