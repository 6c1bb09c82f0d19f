# SPDX-License-Identifier: GPL-3.0-or-later
"""[controller_fan name]: a fan that runs while drivers or heaters work."""
from klippy.extras import fan

CHECK_INTERVAL = 1.0


class ControllerFan:
    """Full speed while active, idle_speed for idle_timeout s after that."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.printer.load_object(config, "stepper_enable")
        self.printer.load_object(config, "heaters")
        self.stepper_names = config.getlist("stepper", None)
        self.fan = fan.Fan(config)
        self.fan_speed = config.getfloat("fan_speed", 1.0,
                                         minval=0.0, maxval=1.0)
        self.idle_speed = config.getfloat("idle_speed", self.fan_speed,
                                          minval=0.0, maxval=1.0)
        self.idle_timeout = config.getint("idle_timeout", 30, minval=0)
        self.heater_names = config.getlist("heater", ("extruder",))
        self.get_status = self.fan.get_status
        self.section = config.get_name()
        self.heaters = []
        self.stepper_enable = None
        self.last_active = None
        self.last_speed = 0.0
        register = self.printer.register_event_handler
        register("klippy:connect", self._handle_connect)
        register("klippy:ready", self._handle_ready)

    def _handle_connect(self):
        heaters = self.printer.lookup_object("heaters")
        self.heaters = [heaters.lookup_heater(n) for n in self.heater_names]
        self.stepper_enable = self.printer.lookup_object("stepper_enable")
        known = self.stepper_enable.get_steppers()
        if self.stepper_names is None:
            self.stepper_names = known
            return
        unknown = [n for n in self.stepper_names if n not in known]
        if unknown:
            raise self.printer.config_error(
                "Option 'stepper' in section '%s' names unknown steppers: %s."
                " The steppers are %s" % (self.section, ", ".join(unknown),
                                          ", ".join(known)))

    def _handle_ready(self):
        reactor = self.printer.get_reactor()
        reactor.register_timer(self._check, reactor.monotonic() + 0.1)

    def _is_active(self, eventtime):
        enables = (self.stepper_enable.lookup_enable(n)
                   for n in self.stepper_names)
        if any(enable.is_motor_enabled() for enable in enables):
            return True
        return any(h.get_temp(eventtime)[1] for h in self.heaters)

    def _choose_speed(self, eventtime):
        if self._is_active(eventtime):
            self.last_active = eventtime
            return self.fan_speed
        if self.last_active is None:
            return 0.0
        is_idling = eventtime - self.last_active < self.idle_timeout
        return self.idle_speed if is_idling else 0.0

    def _check(self, eventtime):
        speed = self._choose_speed(eventtime)
        if speed != self.last_speed:
            self.last_speed = speed
            self.fan.set_speed(speed)
        return eventtime + CHECK_INTERVAL


def load_config_prefix(config):
    return ControllerFan(config)
