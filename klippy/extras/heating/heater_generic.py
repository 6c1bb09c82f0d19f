# SPDX-License-Identifier: GPL-3.0-or-later
"""[heater_generic name]: a heater commanded by SET_HEATER_TEMPERATURE."""


def load_config_prefix(config):
    heaters = config.get_printer().load_object(config, "heaters")
    return heaters.setup_heater(config)
