# SPDX-License-Identifier: GPL-3.0-or-later
"""[hall_filament_width_sensor]: two hall sensors beside a lever on the filament.

The sum of both readings, in 1/10000 of full scale, is a straight line over the width.
"""
import logging

from klippy.extras import query_adc
from klippy.extras.filament_runout import RunoutHelper
from klippy.extras.filament_width import FlowControl

# The printer goes on without it
MAY_LACK_FIRMWARE = True

REPORT_TIME = 0.500         # s
SAMPLE_TIME = 0.01
SAMPLE_COUNT = 15
FULL_SCALE = 10000


class HallFilamentWidthSensor:
    """Status: as RunoutHelper, and Diameter (mm), Raw, is_active,
    flow_compensation_enabled."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.adcs = [self._setup_adc(config, option) for option in ("adc1", "adc2")]
        self._read_calibration(config)
        interval = config.getint("measurement_interval", 10)
        max_difference = config.getfloat("max_difference", 0.2)
        self.flow = FlowControl(config, self.measure, interval, max_difference)
        self.flow.is_compensating = config.getboolean("enable_flow_compensation", True)
        self.flow.uses_passing = config.getboolean("use_current_dia_while_delay", False)
        self.flow.on_measured = self._note_width
        self.is_enabled = config.getboolean("enable", False)
        self.min_diameter = config.getfloat("min_diameter", 1.0)
        self.max_diameter = config.getfloat(
            "max_diameter", self.flow.nominal + max_difference)
        self.is_logging = config.getboolean("logging", False)
        self.runout_helper = RunoutHelper(config)
        self.runout_helper.part = getattr(self.adcs[0], "part", None)
        self._register(printer)

    def _setup_adc(self, config, option):
        adc = self.printer.lookup_object("pins").setup_pin("adc", config.get(option))
        adc.setup_adc_sample(REPORT_TIME, SAMPLE_TIME, SAMPLE_COUNT)
        adc.setup_adc_callback(lambda samples: None)
        query_adc.register(config, "%s:%s" % (config.get_name(), option), adc)
        return adc

    def _read_calibration(self, config):
        self.dias = [config.getfloat("cal_dia%d" % (i,), default)
                     for i, default in ((1, 1.5), (2, 2.0))]
        self.raws = [config.getint("raw_dia%d" % (i,), default)
                     for i, default in ((1, 9500), (2, 10500))]
        if self.raws[0] == self.raws[1]:
            raise config.error("Options 'raw_dia1' and 'raw_dia2' in section '%s' must"
                               " differ" % (config.get_name(),))

    def _register(self, printer):
        gcode = printer.lookup_object("gcode")
        for name in ("QUERY_RAW_FILAMENT_WIDTH", "ENABLE_FILAMENT_WIDTH_LOG",
                     "DISABLE_FILAMENT_WIDTH_LOG"):
            gcode.register_command(name, getattr(self, "cmd_" + name),
                                   desc=getattr(self, "cmd_%s_help" % name))
        printer.register_event_handler("klippy:ready", self._handle_ready)

    def _handle_ready(self):
        if self.is_enabled:
            self.flow.start()

    def read_raw(self):
        """Sum of both sensors."""
        return sum(int(adc.get_last_value()[0] * FULL_SCALE + 0.5)
                   for adc in self.adcs)

    def measure(self):
        """Width in mm; None before the first readings."""
        if not all(adc.get_last_value()[1] for adc in self.adcs):
            return None
        slope = (self.dias[1] - self.dias[0]) / (self.raws[1] - self.raws[0])
        return self.dias[0] + (self.read_raw() - self.raws[0]) * slope

    def _note_width(self, eventtime, width):
        self.runout_helper.note_filament_present(
            eventtime, self.min_diameter <= width <= self.max_diameter)
        if self.is_logging:
            logging.info("Filament width %.3f mm, raw %d, flow %.1f %%", width,
                         self.read_raw(), self.flow.percent)

    def get_status(self, eventtime):
        return {**self.runout_helper.get_status(eventtime),
                "Diameter": self.measure() or 0.0, "Raw": self.read_raw(),
                "is_active": self.flow.is_active,
                "flow_compensation_enabled": self.flow.is_compensating}

    cmd_QUERY_RAW_FILAMENT_WIDTH_help = "Report the readings of both sensors"

    def cmd_QUERY_RAW_FILAMENT_WIDTH(self, gcmd):
        values = [int(adc.get_last_value()[0] * FULL_SCALE + 0.5) for adc in self.adcs]
        gcmd.respond_info("ADC1=%d ADC2=%d RAW=%d" % (*values, sum(values)))

    cmd_ENABLE_FILAMENT_WIDTH_LOG_help = "Write measured widths to the log"

    def cmd_ENABLE_FILAMENT_WIDTH_LOG(self, gcmd):
        self.is_logging = True
        gcmd.respond_info("Filament width logging turned on")

    cmd_DISABLE_FILAMENT_WIDTH_LOG_help = "Write no measured widths to the log"

    def cmd_DISABLE_FILAMENT_WIDTH_LOG(self, gcmd):
        self.is_logging = False
        gcmd.respond_info("Filament width logging turned off")


def load_config(config):
    return HallFilamentWidthSensor(config)
