# SPDX-License-Identifier: GPL-3.0-or-later
"""The errors of the host, one small tree.

A message says what is wrong, where, and what would be right, with the value
quoted.  Anything else that is raised is a defect of the program.
"""


class PrinterError(Exception):
    """Root of all errors that have a message for the user."""


class Place:
    """Where in the config files something is: file, line and column (0: unknown).

    value_column: where the value of an option begins, 0 without one.
    """

    __slots__ = ("path", "line", "column", "value_column")

    def __init__(self, path, line=0, column=0, value_column=0):
        self.path, self.line = path, line
        self.column, self.value_column = column, value_column

    def at_value(self):
        """The Place of the option's value."""
        return Place(self.path, self.line, self.value_column or self.column)

    def __str__(self):
        return "%s:%d" % (self.path, self.line) if self.line else str(self.path)

    def __eq__(self, other):
        return (isinstance(other, Place)
                and (self.path, self.line) == (other.path, other.line))

    def __hash__(self):
        return hash((self.path, self.line))


class ConfigError(PrinterError):
    """The config, or what it describes, cannot be used.

    place (Place or None), section and option (names or None) are set where the
    error is found or, at the latest, by whoever loads the section.  nearest: the
    name or value that may have been meant, None if none is known.
    """

    def __init__(self, message="", place=None, section=None, option=None,
                 nearest=None):
        super().__init__(message)
        self.place = place
        self.section, self.option, self.nearest = section, option, nearest

    def __str__(self):
        message = super().__str__()
        return "%s: %s" % (self.place, message) if self.place else message


class ConfigErrors(ConfigError):
    """Several errors, found in one pass over the config (attribute errors)."""

    def __init__(self, errors):
        super().__init__("\n".join(str(err) for err in errors))
        self.errors = list(errors)


class CommandError(PrinterError):
    """A command cannot be carried out; the printer goes on."""


class CommandInterrupted(CommandError):
    """Somebody ended what ran: no failure, but no way to go on either."""


class McuError(PrinterError):
    """A micro-controller, or the link to it, fails.

    details: facts for the advice that is shown (mcu, event_type, reason).
    """

    def __init__(self, message="", details=None):
        super().__init__(message)
        self.details = details


class ShutdownError(PrinterError):
    """The printer is shut down, or must be."""


def collect(errors):
    """The one error to raise for a list of ConfigErrors (at least one)."""
    flat = []
    for err in errors:
        flat.extend(err.errors if isinstance(err, ConfigErrors) else [err])
    return flat[0] if len(flat) == 1 else ConfigErrors(flat)


def describe(err):
    """An error as plain data, None for what is unknown.

    Keys: kind, message, file, line, column, section, option, nearest.
    """
    place = getattr(err, "place", None)
    return {"kind": type(err).__name__,
            "message": Exception.__str__(err),
            "file": str(place.path) if place else None,
            "line": (place.line or None) if place else None,
            "column": (place.column or None) if place else None,
            **{key: getattr(err, key, None)
               for key in ("section", "option", "nearest")}}
