# SPDX-License-Identifier: GPL-3.0-or-later
"""Pin descriptions of the config: parsing, aliases, reservations, sharing.

A description is `[^|~][!][chip:]pin`: `^` pull-up, `~` pull-down, `!` inverted.
Aliases and reservations are applied when the mcu builds its configuration, so
the order of sections in the config file does not matter.
"""

import re

from klippy import errors

PIN_FORMAT = "[^|~][!][chip_name:]pin_name"
DESCRIPTION = re.compile(
    r"\s*(?P<pull>[\^~]?)\s*(?P<invert>!?)\s*"
    r"(?:(?P<chip>[^\^~!:\s][^\^~!:]*?)\s*:)?\s*(?P<pin>[^\^~!:\s]+)\s*")
PIN_ARGUMENT = re.compile(r"(?P<name>[ _]pin=)(?P<pin>[^ ]+)")
INVERTIBLE_TYPES = ("stepper", "endstop", "digital_out", "pwm")
PULLUP_TYPES = ("endstop",)


class error(errors.ConfigError):
    """A pin cannot be used the way the config asks for."""


def near_names(name, known, limit=3):
    """Up to `limit` known names that look like name, best first."""
    folded = {str(k).upper(): k for k in known}
    import difflib
    found = difflib.get_close_matches(name.upper(), folded, limit, 0.5)
    return [folded[f] for f in found]


class PinResolver:
    """Aliases and reservations of the pins of one chip."""

    def __init__(self, chip_name, validate_aliases=True, find_places=None):
        """find_places(names): text that says which options hold these pins."""
        self.chip_name = chip_name
        self.find_places = find_places or (lambda names: "")
        self.validate_aliases = validate_aliases
        self.reserved = {}
        self.aliases = {}
        self.active_pins = {}
        self.shared_pins = set()

    def reserve_pin(self, pin, reserve_name):
        """Keep pin for the firmware's own use `reserve_name`."""
        holder = self.reserved.setdefault(pin, reserve_name)
        if holder != reserve_name:
            raise error("Pin '%s' of chip '%s' is reserved twice: for %s and for %s"
                        % (pin, self.chip_name, holder, reserve_name))

    def alias_pin(self, alias, pin):
        """Let alias stand for pin, which may be an alias itself."""
        known = self.aliases.get(alias, pin)
        if known != pin:
            raise error("Alias '%s' of chip '%s' cannot mean both '%s' and '%s'"
                        % (alias, self.chip_name, known, pin))
        if "^" in pin or "~" in pin or "!" in pin or ":" in pin:
            raise error("Alias '%s' must stand for a plain pin name, not '%s'"
                        % (alias, pin))
        target = self.aliases.get(pin, pin)
        if self.validate_aliases and target == alias:
            raise error("Alias '%s' of chip '%s' stands for itself (by way of '%s')"
                        % (alias, self.chip_name, pin))
        self.aliases[alias] = target
        for other, value in list(self.aliases.items()):
            if value == alias:
                self.aliases[other] = target

    def resolve(self, name):
        """The chip's own name of pin `name`, noting that it is in use."""
        pin = self.aliases.get(name, name)
        first = self.active_pins.setdefault(pin, name)
        if first != name and not {name, first} & self.shared_pins:
            raise error("Pin '%s' of chip '%s' is in use both as '%s' and as '%s'%s:"
                        " give it one name" % (pin, self.chip_name, first, name,
                                               self.find_places((first, name))))
        if pin in self.reserved:
            raise error("Pin '%s' of chip '%s'%s is reserved for %s" % (
                name, self.chip_name, self.find_places((name,)),
                self.reserved[pin]))
        return pin

    def update_command(self, cmd):
        """A config command with all its pin names resolved."""
        return PIN_ARGUMENT.sub(
            lambda m: m.group("name") + self.resolve(m.group("pin")), cmd)


class PrinterPins:
    """Registry of the chips that have pins and of who uses which pin."""

    error = error

    def __init__(self, printer=None):
        self.printer = printer
        self.chips = {}
        self.active_pins = {}
        self.pin_resolvers = {}
        self.allow_multi_use_pins = set()

    def parse_pin(self, pin_desc, can_invert=False, can_pullup=False):
        """Take a pin description apart; returns a dict of its parts.

        Keys: chip, chip_name, pin, invert (0, 1), pullup (-1, 0, 1).
        """
        match = DESCRIPTION.fullmatch(pin_desc)
        if match is None:
            raise error("Invalid pin description '%s'%s: the format is %s"
                        % (pin_desc, self._where(pin_desc), PIN_FORMAT))
        pull, invert = match.group("pull"), match.group("invert")
        if pull and not can_pullup:
            raise error("Pin '%s'%s cannot have a pull-up or pull-down ('%s')"
                        % (pin_desc, self._where(pin_desc), pull))
        if invert and not can_invert:
            raise error("Pin '%s'%s cannot be inverted ('!')"
                        % (pin_desc, self._where(pin_desc)))
        chip_name = match.group("chip") or "mcu"
        if chip_name not in self.chips:
            raise error("Unknown pin chip name '%s' in pin '%s'%s%s"
                        % (chip_name, pin_desc, self._where(pin_desc),
                           offer(near_names(chip_name, self.chips))))
        return {"chip": self.chips[chip_name], "chip_name": chip_name,
                "pin": match.group("pin"), "invert": int(bool(invert)),
                "pullup": {"^": 1, "~": -1}.get(pull, 0)}

    def lookup_pin(self, pin_desc, can_invert=False, can_pullup=False,
                   share_type=None):
        """Parse a pin and note its use.

        Raises error if it is in use already, unless both users give the same
        share_type (then the first user's dict is returned) or it is in
        [duplicate_pin_override].
        """
        params = self.parse_pin(pin_desc, can_invert, can_pullup)
        share_name = self._share_name(params)
        used = self.active_pins.get(share_name)
        if used is None:
            params["share_type"] = share_type
            self.active_pins[share_name] = params
            return params
        if share_name in self.allow_multi_use_pins:
            params["share_type"] = share_type
            return params
        if share_type is None or share_type != used["share_type"]:
            raise error("Pin '%s' is used more than once%s: list it in"
                        " [duplicate_pin_override] if that is what you want"
                        % (params["pin"], self._where(pin_desc)))
        if any(params[k] != used[k] for k in ("invert", "pullup")):
            raise error("Shared pin '%s' must have the same polarity and pull-up"
                        " everywhere%s" % (params["pin"], self._where(pin_desc)))
        return used

    def setup_pin(self, pin_type, pin_desc):
        """Make the object that drives pin_desc as a pin_type.

        pin_type: stepper, endstop, digital_out, pwm or adc.
        """
        params = self.lookup_pin(pin_desc, pin_type in INVERTIBLE_TYPES,
                                 pin_type in PULLUP_TYPES)
        return params["chip"].setup_pin(pin_type, params)

    def reset_pin_sharing(self, pin_params):
        """Let a looked up pin be looked up again."""
        self.active_pins.pop(self._share_name(pin_params), None)

    def get_pin_resolver(self, chip_name):
        """The PinResolver of a chip."""
        if chip_name not in self.pin_resolvers:
            raise error("Unknown chip name '%s'%s"
                        % (chip_name, offer(near_names(chip_name, self.chips))))
        return self.pin_resolvers[chip_name]

    def register_chip(self, chip_name, chip):
        """Add a chip; it has setup_pin(pin_type, pin_params)."""
        chip_name = chip_name.strip()
        if chip_name in self.chips:
            raise error("Duplicate chip name '%s'" % (chip_name,))
        self.chips[chip_name] = chip
        self.pin_resolvers[chip_name] = PinResolver(
            chip_name, find_places=lambda names: self._where(
                *("%s:%s" % (chip_name, name) for name in names)))

    def allow_multi_use_pin(self, pin_desc):
        """Allow any number of users of this pin."""
        params = self.parse_pin(pin_desc)
        self.allow_multi_use_pins.add(self._share_name(params))
        self.pin_resolvers[params["chip_name"]].shared_pins.add(params["pin"])

    @staticmethod
    def _share_name(params):
        return "%s:%s" % (params["chip_name"], params["pin"])

    def _where(self, *pin_descs):
        """Text that names all config options which mention these pins."""
        users = [user for pin_desc in pin_descs
                 for user in find_users(self.printer, pin_desc)]
        return " (%s)" % (", ".join(users),) if users else ""


def offer(names):
    """Text that proposes the names, or nothing."""
    if not names:
        return ""
    return "; did you mean %s?" % (" or ".join("'%s'" % n for n in names),)


def bare_name(pin_desc):
    """Chip and pin of a description, without its modifiers."""
    name = re.sub(r"[\^~!\s]", "", str(pin_desc))
    return name if ":" in name else "mcu:" + name


def find_users(printer, pin_desc):
    """Config options that hold this pin, as '[section] option' texts."""
    configfile = printer and printer.lookup_object("configfile", None)
    if configfile is None:
        return []
    wanted = bare_name(pin_desc)
    sections = configfile.get_status(0.)["config"]
    return ["[%s] %s at %s" % (section, option, configfile.get_place(section, option))
            for section, options in sections.items()
            for option, value in options.items()
            if is_pin_option(option) and wanted in list_names(option, value)]


def is_pin_option(option):
    """True for options that hold a pin, or pins with commas between them."""
    return option.endswith(("pin", "pins")) or option.startswith(("adc", "aliases"))


def list_names(option, value):
    """Bare names of the pins in an option."""
    parts = [value]
    if not option.endswith("pin"):
        # of an alias, the pin that it stands for
        parts = re.split("[,\n]", str(value))
    return [bare_name(part.split("=")[-1]) for part in parts]


def get_printer_pins(printer):
    """The printer's pin registry."""
    return printer.lookup_object("pins")


get = get_printer_pins


def add_printer_objects(config):
    """Create the pin registry of a printer."""
    printer = config.get_printer()
    printer.add_object("pins", PrinterPins(printer))
