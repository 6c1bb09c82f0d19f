# SPDX-License-Identifier: GPL-3.0-or-later
"""What sensors have in common whose readings are made by the host."""

ABSOLUTE_ZERO = -273.15     # degC


class PolledSensor:
    """A sensor that a timer of the host reads; report_time: s between two readings.

    A subclass has _report(eventtime), which returns the time of the next one.
    """

    report_time = 0.300

    def __init__(self, config):
        self.printer = config.get_printer()
        self.reactor = self.printer.get_reactor()
        self.section = config.get_name()
        self.range = (ABSOLUTE_ZERO, float("inf"))
        self.callback = None
        self.timer = self.reactor.register_timer(self._report)

    def is_live(self):
        """False in a batch run, which has no readings."""
        return self.printer.get_start_args().get("debugoutput") is None

    def setup_minmax(self, min_temp, max_temp):
        """Shut down outside min_temp..max_temp (degC)."""
        self.range = (min_temp, max_temp)

    def setup_callback(self, callback):
        """Call callback(print_time, degC) at each report."""
        self.callback = callback

    def get_report_time_delta(self):
        """Seconds between two reports."""
        return self.report_time

    def _report(self, eventtime):
        raise NotImplementedError

    def _deliver(self, eventtime, temp):
        """Report degC; returns the time of the next report."""
        mcu = self.printer.lookup_object("mcu")
        self.callback(mcu.estimated_print_time(eventtime), temp)
        return eventtime + self.report_time
