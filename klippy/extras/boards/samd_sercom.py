# SPDX-License-Identifier: GPL-3.0-or-later
"""[samd_sercom name]: pins of a SERCOM unit of a SAM C21, D21, D51 or E5x.

A bus sercom0 ... of such an mcu has the pins that this names: tx is MOSI or SDA, rx
is MISO, clk is SCLK or SCL.
"""
from klippy import pins
from klippy.configfile import sentinel

SET_PIN = "set_sercom_pin bus=%s sercom_pin_type=%s pin=%s"


class SamdSercom:
    """Tells the mcu which pins a unit has, before any bus is set up."""

    def __init__(self, config):
        ppins = pins.get(config.get_printer())
        bus = config.get("sercom")
        chips = set()
        for role in ("tx", "rx", "clk"):
            name = config.get(role + "_pin", None if role == "rx" else sentinel)
            if name is None:
                continue
            params = ppins.lookup_pin(name)
            chips.add(params["chip"])
            if len(chips) > 1:
                raise config.error(
                    "Pins of [%s] must be of one mcu: '%s' is of another"
                    % (config.get_name(), name))
            params["chip"].add_config_cmd(SET_PIN % (bus, role, params["pin"]))


def load_config_prefix(config):
    return SamdSercom(config)
