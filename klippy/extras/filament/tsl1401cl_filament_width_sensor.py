# SPDX-License-Identifier: GPL-3.0-or-later
"""[tsl1401cl_filament_width_sensor]: a sensor that gives one volt a millimetre."""
from klippy.extras import query_adc
from klippy.extras.filament_width import FlowControl

# The printer goes on without it
MAY_LACK_FIRMWARE = True

REFERENCE = 5.0             # V
REPORT_TIME = 0.500         # s
SAMPLE_TIME = 0.03
SAMPLE_COUNT = 15
MEASUREMENT_INTERVAL = 10.0  # mm


class FilamentWidthSensor:
    """Always measures, unless it is turned off."""

    def __init__(self, config):
        printer = config.get_printer()
        self.mcu_adc = printer.lookup_object("pins").setup_pin("adc", config.get("pin"))
        self.mcu_adc.setup_adc_sample(REPORT_TIME, SAMPLE_TIME, SAMPLE_COUNT)
        self.mcu_adc.setup_adc_callback(lambda samples: None)
        query_adc.register(config, config.get_name(), self.mcu_adc)
        self.flow = FlowControl(
            config, self._measure, MEASUREMENT_INTERVAL,
            config.getfloat("max_difference", above=0.0))
        printer.register_event_handler("klippy:ready", self.flow.start)

    def _measure(self):
        value, read_time = self.mcu_adc.get_last_value()
        return value * REFERENCE if read_time else None


def load_config(config):
    return FilamentWidthSensor(config)
