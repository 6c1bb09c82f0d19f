# SPDX-License-Identifier: GPL-3.0-or-later
"""References in values: `${option}`, `${section.option}`, replaced by that value.

What looks like one but names nothing stays as it is, since a template may have a
`$` in front of its braces.  It is an error where a reference must be meant: to
[constants], and in a config with that section anywhere but in G-code.
"""

import re

from klippy.confignames import find_nearest
from klippy.errors import ConfigError

CONSTANTS = "constants"
_REFERENCE = re.compile(r"\$\{([^{}\n]+)\}")


class Expander:
    """Replaces the references of one ConfigStore; errors collects what is wrong."""

    def __init__(self, store):
        self.store, self.errors = store, []
        self.done, self.open = {}, []       # values; names being replaced
        self.is_strict = CONSTANTS in store.sections()

    def expand_all(self):
        """Replace the references of all values; returns the errors."""
        for section in self.store.sections():
            for option, value in self.store.items(section):
                if "${" in value:
                    self.store.expand(section, option, self._get(section, option))
        return self.errors

    def _get(self, section, option):
        """The value of an option that exists, without references."""
        key = section, option
        if key not in self.done:
            text = self.store.get_written(section, option)
            self.open.append(key)
            self.done[key] = _REFERENCE.sub(self._replace, text)
            self.open.pop()
        return self.done[key]

    def _replace(self, match):
        here, option = self.open[-1]
        section, is_elsewhere, name = match[1].strip().rpartition(".")
        section, name = section.strip() if is_elsewhere else here, name.strip().lower()
        if name in self.store.options(section):
            if (section, name) in self.open:
                self._fail("it goes in a circle: %s" % (" -> ".join(
                    "[%s] %s" % key for key in [*self.open, (section, name)]),), match)
                return match[0]
            self.store.referenced.add((section, name))
            return self._get(section, name)
        if section == CONSTANTS or (self.is_strict and not option.endswith("gcode")):
            self._fail_unknown(section, name, match)
        return match[0]

    def _fail_unknown(self, section, name, match):
        store = self.store
        if section not in store.sections():
            nearest = find_nearest(section, store.sections())
            text = "there is no section [%s]" % (section,)
        else:
            nearest = find_nearest(name, store.options(section))
            text = "section [%s] has no option '%s'" % (section, name)
        hint = "; did you mean '%s'?" % (nearest,) if nearest else ""
        self._fail(text + hint, match, nearest)

    def _fail(self, text, match, nearest=None):
        section, option = self.open[-1]
        place = self.store.get_place(section, option)
        self.errors.append(ConfigError(
            "option '%s' in section [%s]: '%s' refers to nothing: %s"
            % (option, section, match[0], text),
            place.at_value() if place is not None else None, section, option, nearest))


def expand(store):
    """Replace the references in all values of a store; returns the ConfigErrors."""
    return Expander(store).expand_all()
