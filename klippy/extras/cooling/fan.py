# SPDX-License-Identifier: GPL-3.0-or-later
"""Fans: the pwm output with kick start, and [fan] with M106 and M107."""

from klippy.extras import fan_watch, request_queue, tachometer
from klippy.record import record

# The printer goes on without it
MAY_LACK_FIRMWARE = True

FAN_MIN_TIME = request_queue.PIN_MIN_TIME
# A change of speed by more than this gets a kick start.
KICK_START_CHANGE = 0.5


@record(frozen=True)
class FanOptions:
    """Options common to every kind of fan section."""

    max_power: float
    min_power: float
    initial_speed: float
    kick_start_time: float
    off_below: float
    cycle_time: float
    hardware_pwm: bool
    shutdown_speed: float

    @classmethod
    def from_config(cls, config, default_shutdown_speed):
        max_power = config.getfloat("max_power", 1.0, above=0.0, maxval=1.0)
        min_power = config.getfloat("min_power", 0.0, minval=0.0, maxval=1.0)
        if min_power > max_power:
            raise config.error(
                "Option 'min_power' in section '%s' must not be above max_power, %s"
                % (config.get_name(), max_power))
        return cls(
            max_power, min_power,
            config.getfloat("initial_speed", 0.0, minval=0.0, maxval=1.0),
            config.getfloat("kick_start_time", 0.1, minval=0.0),
            config.getfloat("off_below", 0.0, minval=0.0, maxval=1.0),
            config.getfloat("cycle_time", 0.010, above=0.0),
            config.getboolean("hardware_pwm", False),
            config.getfloat("shutdown_speed", default_shutdown_speed,
                            minval=0.0, maxval=1.0))


class Fan:
    """A fan.  Status: speed and power (0..1 of full power; power is what the pin has
    now), value (0..1, as asked for), rpm (None without tachometer)."""

    def __init__(self, config, default_shutdown_speed=0.0):
        self.printer = config.get_printer()
        self.options = FanOptions.from_config(config, default_shutdown_speed)
        self.last_speed = self.options.initial_speed
        self.last_fan_value = self.last_req_value = self._calc_power(self.last_speed)
        self._setup_pins(config)
        self.tachometer = tachometer.FanTachometer(config)
        self.requests = request_queue.GCodeRequestQueue(
            config, self.mcu_fan.get_mcu(), self._apply_speed)
        self.printer.register_event_handler(
            "gcode:request_restart", self._handle_request_restart)
        fan_watch.watch(self, config.get_name())

    def _setup_pins(self, config):
        ppins = self.printer.lookup_object("pins")
        options = self.options
        self.mcu_fan = ppins.setup_pin("pwm", config.get("pin"))
        self.mcu_fan.setup_max_duration(0.0)
        self.mcu_fan.setup_cycle_time(options.cycle_time, options.hardware_pwm)
        self.mcu_fan.setup_start_value(
            self.last_fan_value, min(options.shutdown_speed, options.max_power))
        self.enable_pin = None
        pin = config.get("enable_pin", None)
        if pin is not None:
            self.enable_pin = ppins.setup_pin("digital_out", pin)
            self.enable_pin.setup_max_duration(0.0)
            if self.last_fan_value:
                self.enable_pin.setup_start_value(1, 0)

    def get_mcu(self):
        return self.mcu_fan.get_mcu()

    def _calc_power(self, speed):
        low, high = self.options.min_power, self.options.max_power
        if speed <= 0.0 or speed < self.options.off_below:
            return 0.0
        return low + min(speed, 1.0) * (high - low)

    def _apply_speed(self, print_time, speed):
        power = self._calc_power(speed)
        self.last_speed = min(max(speed, 0.0), 1.0)
        if power == self.last_fan_value:
            return "discard", 0.0
        is_start = not self.last_fan_value
        if self.enable_pin is not None and is_start != (not power):
            self.enable_pin.set_digital(print_time, int(bool(power)))
        needs_kick = (
            power and self.options.kick_start_time
            and power < self.options.max_power
            and self.last_req_value != power
            and (is_start or power - self.last_fan_value > KICK_START_CHANGE))
        self.last_req_value = power
        if needs_kick:
            self.last_fan_value = self.options.max_power
            self.mcu_fan.set_pwm(print_time, self.options.max_power)
            return "delay", self.options.kick_start_time
        self.last_fan_value = power
        self.mcu_fan.set_pwm(print_time, power)
        return None

    def set_speed(self, value, print_time=None):
        """Set a speed (0..1) as soon as possible, or at a print_time."""
        self.requests.send_async_request(value, print_time)

    def set_speed_from_command(self, value):
        """Set a speed (0..1) after the moves planned so far."""
        self.requests.queue_gcode_request(value)

    def _handle_request_restart(self, print_time):
        self.set_speed(0.0)

    def get_status(self, eventtime):
        return {"speed": self.last_req_value, "power": self.last_fan_value,
                "value": self.last_speed,
                "rpm": self.tachometer.get_status(eventtime)["rpm"]}


class PrinterFan:
    """The part cooling fan."""

    def __init__(self, config):
        self.fan = Fan(config)
        self.get_status = self.fan.get_status
        gcode = config.get_printer().lookup_object("gcode")
        gcode.register_command("M106", self.cmd_M106)
        gcode.register_command("M107", self.cmd_M107)

    def cmd_M106(self, gcmd):
        """Set the fan to S (0..255)."""
        speed = gcmd.get_float("S", 255.0, minval=0.0) / 255.0
        self.fan.set_speed_from_command(speed)

    def cmd_M107(self, gcmd):
        """Turn the fan off."""
        self.fan.set_speed_from_command(0.0)

    # "Off" is no error, whatever the fan lacks: macros go on behind it
    cmd_M106.is_harmless = lambda gcmd: gcmd.get_float("S", 255.0) <= 0.0
    cmd_M107.is_harmless = lambda gcmd: True


def load_config(config):
    return PrinterFan(config)
