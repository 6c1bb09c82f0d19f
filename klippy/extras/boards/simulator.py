# SPDX-License-Identifier: GPL-3.0-or-later
"""[simulator]: options of the simulated machine, without effect on a real one.

The simulated machine reads this section itself before the printer starts;
here it is only checked, so that one printer.cfg serves both.
"""

PER_NAME_OPTIONS = ("clock_ppm", "heater_power", "heat_capacity", "heat_loss",
                    "filament_length", "filament_jam", "filament_diameter")


class SimulatorSection:
    """Range checks of [simulator]; status: is_simulated."""

    def __init__(self, config):
        start_args = config.get_printer().get_start_args()
        self.is_simulated = start_args.get("machine") is not None
        config.getint("seed", 1)
        config.getfloat("ambient_temp", 25.0, minval=-50.0, maxval=150.0)
        config.getint("baud", 250000, minval=2400)
        config.getfloat("latency", 0.0002, minval=0.0, maxval=1.0)
        config.getint("clock_freq", 0, minval=0)
        config.getfloat("encoder_edge", 1.44, above=0.0)
        config.get("firmware", None)
        config.getfloatlist("start_position", None, count=3)
        for option in PER_NAME_OPTIONS:
            config.get(option, None)

    def get_status(self, eventtime):
        return {"is_simulated": self.is_simulated}


def load_config(config):
    return SimulatorSection(config)
