# SPDX-License-Identifier: GPL-3.0-or-later
"""[output_pin name]: a digital or pwm pin set by SET_PIN or a template."""
from klippy.extras import template_evaluator
from klippy.extras.request_queue import GCodeRequestQueue

# The printer goes on without it
MAY_LACK_FIRMWARE = True

__all__ = ["GCodeRequestQueue", "PrinterOutputPin"]


class PrinterOutputPin:
    """Status: value, 0..1 of full scale."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.is_pwm = config.getboolean("pwm", False)
        self.mcu_pin = self._setup_pin(config)
        self.mcu_pin.setup_max_duration(0.0)
        self.scale = 1.0
        if self.is_pwm:
            self.scale = config.getfloat("scale", 1.0, above=0.0)
        self.last_value = self._read_value(config, "value")
        shutdown = self._read_value(config, "shutdown_value")
        self.mcu_pin.setup_start_value(self.last_value, shutdown)
        self.requests = GCodeRequestQueue(
            config, self.mcu_pin.get_mcu(), self._set_pin)
        self.evaluator = self.printer.load_object(config, "template_evaluator")
        name = config.get_name().split()[1]
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_PIN", "PIN", name, self.cmd_SET_PIN,
            desc=self.cmd_SET_PIN_help)

    def _setup_pin(self, config):
        ppins = self.printer.lookup_object("pins")
        if not self.is_pwm:
            return ppins.setup_pin("digital_out", config.get("pin"))
        pin = ppins.setup_pin("pwm", config.get("pin"))
        longest = pin.get_mcu().max_nominal_duration()
        cycle_time = config.getfloat("cycle_time", 0.100, above=0.0,
                                     maxval=longest)
        pin.setup_cycle_time(cycle_time,
                             config.getboolean("hardware_pwm", False))
        return pin

    def _read_value(self, config, option):
        return config.getfloat(
            option, 0.0, minval=0.0, maxval=self.scale) / self.scale

    def _set_pin(self, print_time, value):
        if value == self.last_value:
            return "discard", 0.0
        self.last_value = value
        if self.is_pwm:
            self.mcu_pin.set_pwm(print_time, value)
        else:
            self.mcu_pin.set_digital(print_time, value)
        return None

    def get_status(self, eventtime):
        return {"value": self.last_value}

    cmd_SET_PIN_help = "Set the value of an output pin"

    def cmd_SET_PIN(self, gcmd):
        value = gcmd.get_float("VALUE", None, minval=0.0, maxval=self.scale)
        template = gcmd.get("TEMPLATE", None)
        if (value is None) == (template is None):
            raise gcmd.error("SET_PIN PIN=%s needs either VALUE or TEMPLATE"
                             % (gcmd.get("PIN"),))
        if template is not None:
            self.evaluator.set_template(gcmd, self, self._show_text)
            return
        value /= self.scale
        if not self.is_pwm and value not in (0.0, 1.0):
            raise gcmd.error("SET_PIN PIN=%s: VALUE of a pin without pwm must"
                             " be 0 or 1, not %s"
                             % (gcmd.get("PIN"), gcmd.get("VALUE")))
        self.evaluator.remove(self)
        self.requests.queue_gcode_request(value)

    def _show_text(self, text):
        value = template_evaluator.read_number(text, self.scale) / self.scale
        if not self.is_pwm:
            value = float(value >= 0.5)
        self.requests.send_async_request(value)


def load_config_prefix(config):
    return PrinterOutputPin(config)
