# SPDX-License-Identifier: GPL-3.0-or-later
"""[statistics]: once a second, the state of all parts as one line of the log.

Also adds the object `system_stats`: load, processor time and memory.
"""

import logging
import os
import re
import time

from klippy import dangers

PERIOD = 1.0            # s
MEMORY_FILE = "/proc/meminfo"
_AVAILABLE = re.compile(r"^MemAvailable:\s+(\d+) kB", re.MULTILINE)


class SystemStats:
    """Load of the computer."""

    def __init__(self, config):
        self.last_load, self.last_process_time = 0., 0.
        self.available_kb = 0

    def stats(self, eventtime):
        """Measure; the log's text."""
        self.last_process_time = time.process_time()
        self.last_load = os.getloadavg()[0]
        text = "sysload=%.2f cputime=%.3f" % (self.last_load, self.last_process_time)
        self.available_kb = read_available_memory()
        if self.available_kb:
            text += " memavail=%d" % (self.available_kb,)
        return False, text

    def get_status(self, eventtime):
        """sysload; cputime in s; memavail in kB."""
        return {"sysload": self.last_load, "cputime": self.last_process_time,
                "memavail": self.available_kb}


def read_available_memory():
    """kB of memory that programs could take; 0 where it is unknown."""
    try:
        with open(MEMORY_FILE, encoding="ascii", errors="replace") as file:
            found = _AVAILABLE.search(file.read())
    except OSError:
        return 0
    return int(found.group(1)) if found else 0


class PrinterStats:
    """Asks all objects that have stats(eventtime) -> (is_active, text)."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.sources, self.timer = [], None
        self.is_logged = dangers.get(printer).log_statistics
        printer.add_object("system_stats", SystemStats(config))
        printer.register_event_handler("klippy:ready", self._handle_ready)
        printer.register_event_handler("klippy:disconnect", self._stop)

    def _handle_ready(self):
        self.sources = [obj.stats for _, obj in self.printer.lookup_objects()
                        if hasattr(obj, "stats")]
        if not self.printer.get_start_args().get("debugoutput"):
            self.timer = self.reactor.register_timer(
                self._log, self.reactor.monotonic() + PERIOD)

    def _stop(self):
        if self.timer is not None:
            self.reactor.unregister_timer(self.timer)
            self.timer = None

    def collect(self, eventtime):
        """The line for the log; None while nothing is active."""
        answers = [source(eventtime) for source in self.sources]
        if not any(is_active for is_active, _ in answers):
            return None
        return "Stats %.1f: %s" % (
            eventtime, " ".join(text for _, text in answers if text))

    def _log(self, eventtime):
        line = self.collect(eventtime)
        if line is not None and self.is_logged:
            logging.info(line)
        return eventtime + PERIOD


def load_config(config):
    return PrinterStats(config)
