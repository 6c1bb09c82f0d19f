# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of a board's connectors for the pins of its mcu: [board_pins]."""

from klippy import pins


def is_reservation(value):
    """True for <use>, which keeps a pin from being used."""
    return value.startswith("<") and value.endswith(">")


class BoardPins:
    """Puts the aliases of one section into the pin resolvers."""

    def __init__(self, config):
        printer_pins = pins.get(config.get_printer())
        chips = config.getlist("mcu", ("mcu",))
        options = ["aliases"] if config.get("aliases", None) is not None else []
        options += config.get_prefix_options("aliases_")
        if not options:
            raise config.error("Section '%s' needs an option 'aliases' or 'aliases_...'"
                               % (config.get_name(),))
        pairs = []
        for option in options:
            pairs += config.getlists(option, seps=("=", ","), count=2)
        try:
            for chip in chips:
                self._add(printer_pins.get_pin_resolver(chip), pairs)
        except pins.error as err:
            raise config.error("Section '%s': %s" % (config.get_name(), err))

    def _add(self, resolver, pairs):
        for name, value in pairs:
            if is_reservation(value):
                resolver.reserve_pin(name, value)
            else:
                resolver.alias_pin(name, value)


def load_config(config):
    return BoardPins(config)


def load_config_prefix(config):
    return BoardPins(config)
