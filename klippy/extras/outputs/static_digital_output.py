# SPDX-License-Identifier: GPL-3.0-or-later
"""[static_digital_output name]: pins set once when the mcu starts."""


class PrinterStaticDigitalOut:
    """Pins at a fixed level: 1, or 0 for a pin written with '!'."""

    def __init__(self, config):
        ppins = config.get_printer().lookup_object("pins")
        for text in config.getlist("pins"):
            pin = ppins.lookup_pin(text, can_invert=True)
            pin["chip"].add_config_cmd("set_digital_out pin=%s value=%d"
                                       % (pin["pin"], not pin["invert"]))


def load_config_prefix(config):
    return PrinterStaticDigitalOut(config)
