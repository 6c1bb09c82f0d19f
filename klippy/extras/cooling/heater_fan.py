# SPDX-License-Identifier: GPL-3.0-or-later
"""[heater_fan name]: a fan that runs while a heater is on or hot."""
from klippy.extras import fan

CHECK_INTERVAL = 1.0


class PrinterHeaterFan:
    """Status as in Fan."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.printer.load_object(config, "heaters")
        self.heater_names = config.getlist("heater", ("extruder",))
        self.heater_temp = config.getfloat("heater_temp", 50.0)
        self.fan = fan.Fan(config, default_shutdown_speed=1.0)
        self.fan_speed = config.getfloat("fan_speed", 1.0,
                                         minval=0.0, maxval=1.0)
        self.get_status = self.fan.get_status
        self.heaters = []
        self.last_speed = 0.0
        self.printer.register_event_handler("klippy:ready", self._handle_ready)

    def _handle_ready(self):
        heaters = self.printer.lookup_object("heaters")
        self.heaters = [heaters.lookup_heater(n) for n in self.heater_names]
        reactor = self.printer.get_reactor()
        reactor.register_timer(self._check, reactor.monotonic() + 0.1)

    def _is_needed(self, eventtime):
        readings = [heater.get_temp(eventtime) for heater in self.heaters]
        return any(target or temp > self.heater_temp
                   for temp, target in readings)

    def _check(self, eventtime):
        speed = self.fan_speed if self._is_needed(eventtime) else 0.0
        if speed != self.last_speed:
            self.last_speed = speed
            self.fan.set_speed(speed)
        return eventtime + CHECK_INTERVAL


def load_config_prefix(config):
    return PrinterHeaterFan(config)
