# SPDX-License-Identifier: GPL-3.0-or-later
"""[servo name]: a hobby servo, told where to turn by the width of a pulse."""
from klippy.extras.request_queue import GCodeRequestQueue

# The printer goes on without it
MAY_LACK_FIRMWARE = True

# Servos expect a pulse every so often (s)
FRAME_TIME = 0.020


class PrinterServo:
    """Status: value, the share of each frame that the pulse takes (0: none)."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.min_width = config.getfloat(
            "minimum_pulse_width", 0.001, above=0.0, below=FRAME_TIME)
        self.max_width = config.getfloat(
            "maximum_pulse_width", 0.002, above=self.min_width, below=FRAME_TIME)
        self.max_angle = config.getfloat("maximum_servo_angle", 180.0, above=0.0)
        self.last_value = self._read_start(config) / FRAME_TIME
        self.mcu_pin = self._setup_pin(config)
        self.requests = GCodeRequestQueue(
            config, self.mcu_pin.get_mcu(), self._set_value)
        name = config.get_name().split()[1]
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_SERVO", "SERVO", name, self.cmd_SET_SERVO,
            desc=self.cmd_SET_SERVO_help)

    def _read_start(self, config):
        angle = config.getfloat("initial_angle", None, minval=0.0, maxval=360.0)
        if angle is not None:
            return self._calc_angle_width(angle)
        return self._limit_width(config.getfloat(
            "initial_pulse_width", 0.0, minval=0.0, maxval=self.max_width))

    def _setup_pin(self, config):
        ppins = self.printer.lookup_object("pins")
        pin = ppins.setup_pin("pwm", config.get("pin"))
        pin.setup_max_duration(0.0)
        pin.setup_cycle_time(FRAME_TIME)
        pin.setup_start_value(self.last_value, 0.0)
        return pin

    def _limit_width(self, width):
        """Width in s of a pulse that the servo can follow; 0 stays 0."""
        if not width:
            return 0.0
        return max(self.min_width, min(self.max_width, width))

    def _calc_angle_width(self, angle):
        """Width in s of the pulse for an angle in degrees."""
        share = max(0.0, min(1.0, angle / self.max_angle))
        return self.min_width + share * (self.max_width - self.min_width)

    def _set_value(self, print_time, value):
        if value == self.last_value:
            return "discard", 0.0
        self.last_value = value
        self.mcu_pin.set_pwm(print_time, value)
        return None

    def get_status(self, eventtime):
        return {"value": self.last_value}

    cmd_SET_SERVO_help = "Set servo angle or the width of its pulses"

    def cmd_SET_SERVO(self, gcmd):
        width = gcmd.get_float("WIDTH", None)
        if width is not None:
            width = self._limit_width(width)
        else:
            width = self._calc_angle_width(gcmd.get_float("ANGLE"))
        self.requests.queue_gcode_request(width / FRAME_TIME)


def load_config_prefix(config):
    return PrinterServo(config)
