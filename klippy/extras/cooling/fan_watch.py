# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells the user of a fan that should turn and, by its tachometer, stands still."""

import logging

from klippy.extras import tachometer
from klippy.mcu import absence

CHECK_INTERVAL = 1.0
# So long (s) after its kick start a fan has power and does not turn
STANDSTILL_TIME = 5.0


class FanWatch:
    """Watches a Fan that has a tachometer; told once, again after it has turned.

    It is a word to the user and nothing more: what hangs on the fan goes on.
    """

    def __init__(self, fan, section):
        self.fan, self.section = fan, section
        self.printer = fan.printer
        # counted in samples: those of a link that is cut do not come
        self.limit = ((STANDSTILL_TIME + fan.options.kick_start_time)
                      / tachometer.SAMPLE_TIME)
        self.still_since = None
        self.has_told = False
        self.printer.register_event_handler("klippy:ready", self._handle_ready)

    def _handle_ready(self):
        reactor = self.printer.get_reactor()
        reactor.register_timer(self._check, reactor.monotonic() + CHECK_INTERVAL)

    def _check(self, eventtime):
        if self.printer.is_shutdown():
            return self.printer.get_reactor().NEVER
        samples = self.fan.tachometer.samples
        if not self._is_still(eventtime):
            self.still_since = None
        elif self.still_since is None:
            self.still_since = samples
        elif samples - self.still_since >= self.limit and not self.has_told:
            self.has_told = True
            self._tell()
        return eventtime + CHECK_INTERVAL

    def _is_still(self, eventtime):
        """True if it has power and is known not to turn."""
        meter = self.fan.tachometer
        if not meter.has_reports() or absence.is_absent(self.fan.get_mcu()):
            return False
        if meter.get_status(eventtime)["rpm"]:
            self.has_told = False
            return False
        return self.fan.last_fan_value > 0.0

    def _tell(self):
        message = (
            "Warning: the fan of section '%s' should turn (power %.2f), but its"
            " tachometer shows that it stands still: check the fan, its plug and"
            " tachometer_pin; if it is only too slow to start, raise min_power or"
            " kick_start_time" % (self.section, self.fan.last_fan_value))
        logging.warning("%s", message)
        self.printer.lookup_object("gcode").respond_info(message, log=False)


def watch(fan, section):
    """Watch a Fan; nothing without a tachometer."""
    if fan.tachometer.frequency is not None:
        FanWatch(fan, section)
