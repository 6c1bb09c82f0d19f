# SPDX-License-Identifier: GPL-3.0-or-later
"""[temperature_fan name]: a fan that holds a sensor at a temperature."""
from klippy import dangers
from klippy.extras import fan, temperature_fan_control, temperature_fan_curve
from klippy.mcu import absence

ABSOLUTE_ZERO = -273.15
MAX_FAN_TIME = 5.0


class TemperatureFan:
    """Status: those of Fan plus temperature, target (degC), control, and points
    ([degC, speed]) of a curve."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.name = config.get_name().split()[-1]
        self.fan = fan.Fan(config, default_shutdown_speed=1.0)
        self._setup_sensor(config)
        self.max_speed_conf = config.getfloat("max_speed", 1.0,
                                              above=0.0, maxval=1.0)
        self.min_speed_conf = config.getfloat("min_speed", 0.3,
                                              minval=0.0, maxval=1.0)
        self.max_speed, self.min_speed = (
            self.max_speed_conf, self.min_speed_conf)
        self.target_temp_conf = self.target_temp = config.getfloat(
            "target_temp", min(40.0, self.max_temp),
            minval=self.min_temp, maxval=self.max_temp)
        kinds = temperature_fan_control.KINDS
        kind = config.getchoice("control", {name: name for name in kinds})
        self.control_name = kind
        self.control = kinds[kind](self, config)
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_TEMPERATURE_FAN_TARGET", "TEMPERATURE_FAN", self.name,
            self.cmd_SET_TEMPERATURE_FAN_TARGET,
            desc=self.cmd_SET_TEMPERATURE_FAN_TARGET_help)
        self.curve_command = None
        if kind == "curve":
            self.curve_command = temperature_fan_curve.CurveCommand(self)
        self.brings_heat = kind != "curve" and config.getboolean("reverse", False)
        self.printer.register_event_handler("klippy:ready", self._run_blind)

    def _setup_sensor(self, config):
        heaters = self.printer.load_object(config, "heaters")
        self.min_temp = config.getfloat("min_temp", minval=ABSOLUTE_ZERO)
        self.max_temp = config.getfloat("max_temp", above=self.min_temp)
        self.sensor = heaters.setup_sensor(config)
        if not dangers.get(self.printer).temp_ignore_limits:
            self.sensor.setup_minmax(self.min_temp, self.max_temp)
        self.sensor.setup_callback(self.temperature_callback)
        heaters.register_sensor(config, self)
        self.mcu = absence.find_mcu(self.sensor)
        if self.mcu is not None:
            absence.watch(self.mcu, self._run_blind, None)
        self.speed_delay = self.sensor.get_report_time_delta()
        self.last_temp = self.last_speed = 0.0
        self.next_speed_time = 0.0

    def temperature_callback(self, read_time, temp):
        """Take a reading (print_time, degC) on the response thread."""
        self.last_temp = temp
        speed = self.control.calc_speed(read_time, temp, self.target_temp)
        if self.target_temp <= 0.0:
            speed = 0.0
        elif speed > 0.0:
            speed = min(max(speed, self.min_speed), self.max_speed)
        self._set_speed(read_time, speed)

    def _set_speed(self, read_time, speed):
        is_small = abs(speed - self.last_speed) < 0.05
        is_switch = bool(speed) != bool(self.last_speed)
        if is_small and not is_switch and read_time < self.next_speed_time:
            return
        speed_time = read_time + self.speed_delay
        self.next_speed_time = speed_time + 0.75 * MAX_FAN_TIME
        self.last_speed = speed
        self.printer.get_reactor().register_async_callback(
            lambda e: self.fan.set_speed(speed, speed_time))

    def _run_blind(self):
        """While the mcu of the sensor is gone: cool as well as may be."""
        if self.mcu is None or not absence.is_absent(self.mcu):
            return
        is_off = self.target_temp <= 0.0 or self.brings_heat
        self.last_temp = self.next_speed_time = 0.0
        self.last_speed = 0.0 if is_off else self.max_speed
        self.fan.set_speed(self.last_speed)

    def get_temp(self, eventtime):
        return self.last_temp, self.target_temp

    def get_status(self, eventtime):
        status = self.fan.get_status(eventtime)
        status["temperature"] = round(self.last_temp, 2)
        status["target"] = self.target_temp
        status["control"] = self.control_name
        if self.curve_command is not None:
            status["points"] = [list(point) for point in self.control.points]
        return status

    def stats(self, eventtime):
        return False, "%s: temp=%.1f fan_speed=%.3f" % (
            self.name, self.last_temp, self.last_speed)

    def set_temp(self, degrees):
        """Set the target (degC), 0 for off; CommandError out of range."""
        if degrees and not self.min_temp <= degrees <= self.max_temp:
            raise self.printer.command_error(
                "Requested temperature (%.1f) of temperature_fan '%s' out of"
                " range (%.1f:%.1f)" % (degrees, self.name, self.min_temp,
                                        self.max_temp))
        self.target_temp = degrees
        self._run_blind()

    cmd_SET_TEMPERATURE_FAN_TARGET_help = (
        "Sets a temperature fan target and speed limits")

    def cmd_SET_TEMPERATURE_FAN_TARGET(self, gcmd):
        target = gcmd.get_float("TARGET", self.target_temp_conf)
        low = gcmd.get_float("MIN_SPEED", self.min_speed_conf,
                             minval=0.0, maxval=1.0)
        high = gcmd.get_float("MAX_SPEED", self.max_speed_conf,
                              above=0.0, maxval=1.0)
        if low > high:
            raise gcmd.error("MIN_SPEED %.3f is above MAX_SPEED %.3f"
                             % (low, high))
        self.set_temp(target)
        self.min_speed, self.max_speed = low, high
        self._run_blind()


def load_config_prefix(config):
    return TemperatureFan(config)
