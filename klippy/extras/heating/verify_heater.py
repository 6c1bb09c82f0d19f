# SPDX-License-Identifier: GPL-3.0-or-later
"""[verify_heater name]: shut down when a heater doesn't do as asked.

While heating up, the temperature must rise by heating_gain within every
check_gain_time.  Once the target was reached, degrees below
target - hysteresis are summed up every second; max_error is the limit.
"""
import logging

CHECK_INTERVAL = 1.0
BED_GAIN_TIME = 60.0
OTHER_GAIN_TIME = 20.0
HINT = ("Check the heater's cartridge, the position and wiring of its sensor,"
        " and the section [verify_heater %s]")


class HeaterCheck:
    """Watches one heater from connect to disconnect."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.heater_name = config.get_name().split()[-1]
        self.hysteresis = config.getfloat("hysteresis", 5.0, minval=0.0)
        self.max_error = config.getfloat("max_error", 120.0, minval=0.0)
        self.heating_gain = config.getfloat("heating_gain", 2.0, above=0.0)
        is_bed = self.heater_name == "heater_bed"
        self.check_gain_time = config.getfloat(
            "check_gain_time", BED_GAIN_TIME if is_bed else OTHER_GAIN_TIME,
            minval=1.0)
        self.heater = None
        self.timer = None
        self.is_approaching = self.is_starting = False
        self.last_target = self.goal_temp = self.error = 0.0
        self.goal_eventtime = 0.0
        self.n_interrupted = (0, 0)
        register = self.printer.register_event_handler
        register("klippy:connect", self._handle_connect)
        register("klippy:shutdown", self._handle_shutdown)

    def _handle_connect(self):
        if self.printer.get_start_args().get("debugoutput") is not None:
            return
        heaters = self.printer.lookup_object("heaters")
        self.heater = heaters.lookup_heater(self.heater_name)
        logging.info("Starting heater checks for %s", self.heater_name)
        reactor = self.printer.get_reactor()
        self.timer = reactor.register_timer(self._check, reactor.NOW)

    def _handle_shutdown(self):
        if self.timer is not None:
            reactor = self.printer.get_reactor()
            reactor.update_timer(self.timer, reactor.NEVER)

    def _check(self, eventtime):
        temp, target = self.heater.get_temp(eventtime)
        if (self.heater.n_expired, self.heater.n_cuts) != self.n_interrupted \
                or self.heater.is_cut:
            self._begin_anew(eventtime, temp, target)
        if temp >= target - self.hysteresis or target <= 0.0:
            self._note_in_range(temp, target)
        else:
            self.error += (target - self.hysteresis) - temp
            if not self.is_approaching:
                self._check_holding(eventtime, temp, target)
            else:
                self._check_climb(eventtime, temp, target)
        self.last_target = target
        if self.printer.is_shutdown():
            return self.printer.get_reactor().NEVER
        return eventtime + CHECK_INTERVAL

    def _begin_anew(self, eventtime, temp, target):
        """Others turned the heater off: the mcu for lack of a host, or the watchdog."""
        self.n_interrupted = (self.heater.n_expired, self.heater.n_cuts)
        self.is_approaching = self.is_starting = target > 0.0
        self.error = 0.0
        self._set_goal(eventtime, temp)

    def _note_in_range(self, temp, target):
        if self.is_approaching and target:
            logging.info("Heater %s within range of %.3f",
                         self.heater_name, target)
        self.is_approaching = self.is_starting = False
        if temp <= target + self.hysteresis:
            self.error = 0.0

    def _check_holding(self, eventtime, temp, target):
        if target != self.last_target:
            logging.info("Heater %s approaching new target of %.3f",
                         self.heater_name, target)
            self.is_approaching = self.is_starting = True
            self.error = 0.0
            self._set_goal(eventtime, temp)
        elif self.error >= self.max_error:
            self._fault("fell too far below its target %.1f" % target, temp)

    def _check_climb(self, eventtime, temp, target):
        if temp >= self.goal_temp:
            self.is_starting = False
            self.error = 0.0
            self._set_goal(eventtime, temp)
        elif eventtime >= self.goal_eventtime:
            self.is_approaching = False
            self._fault("not heating at expected rate", temp)
        elif self.is_starting:
            self.goal_temp = min(self.goal_temp, temp + self.heating_gain)

    def _set_goal(self, eventtime, temp):
        self.goal_temp = temp + self.heating_gain
        self.goal_eventtime = eventtime + self.check_gain_time

    def _fault(self, what, temp):
        msg = "Heater %s %s" % (self.heater_name, what)
        logging.error("%s (at %.1f degC)", msg, temp)
        self.printer.invoke_shutdown(
            "%s (at %.1f degC)\n%s" % (msg, temp, HINT % self.heater_name))


def load_config_prefix(config):
    return HeaterCheck(config)
