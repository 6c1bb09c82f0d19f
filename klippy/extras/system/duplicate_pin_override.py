# SPDX-License-Identifier: GPL-3.0-or-later
"""Pins that several sections may use: [duplicate_pin_override], also with a name."""

from klippy import pins


class DuplicatePinOverride:
    """Allows any number of users for the listed pins."""

    def __init__(self, config):
        printer_pins = pins.get(config.get_printer())
        for pin_desc in config.getlist("pins"):
            printer_pins.allow_multi_use_pin(pin_desc)


def load_config(config):
    return DuplicatePinOverride(config)


load_config_prefix = load_config
