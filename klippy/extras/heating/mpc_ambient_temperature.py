# SPDX-License-Identifier: GPL-3.0-or-later
"""sensor_type mpc_ambient_temperature."""
from klippy.extras.mpc_temperature import MpcAmbientTemperature


def load_config(config):
    config.get_printer().load_object(config, "heaters").add_sensor_factory(
        "mpc_ambient_temperature", MpcAmbientTemperature)
