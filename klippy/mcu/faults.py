# SPDX-License-Identifier: GPL-3.0-or-later
"""What an mcu reports of its own accord: shutdowns and unexpected restarts."""

import logging

from klippy.mcu import absence


class FaultWatch:
    """Turns shutdown reports of one mcu into a shutdown of the printer."""

    def __init__(self, mcu):
        self._mcu = mcu
        self._printer = mcu.get_printer()
        self.is_shutdown = False
        self.is_timeout = False
        # An mcu that may be absent is about to be connected: what it says of its
        # past is no reason for a shutdown
        self.is_muted = False
        self.shutdown_clock = 0
        self.shutdown_msg = ""

    def register(self, serial):
        """Watch an identified mcu."""
        for name in ("shutdown", "is_shutdown"):
            serial.register_response(self._handle_shutdown, name)
        serial.register_response(self._handle_starting, "starting")
        serial.set_fault_callback(self._handle_fault)

    def reset(self):
        """Forget all: the mcu is connected afresh."""
        self.is_shutdown = self.is_timeout = False
        self.shutdown_clock, self.shutdown_msg = 0, ""

    def get_hint(self):
        """Text with the last known reason, for messages."""
        return " (it said: %s)" % (self.shutdown_msg,) if self.shutdown_msg else ""

    def note_lost(self):
        """The mcu answers no longer."""
        if absence.may_be_absent(self._mcu):
            self._note_absent("it does not answer")
            return
        if self.is_timeout or self.is_shutdown:
            return
        self.is_timeout = True
        name = self._mcu.get_name()
        logging.info("mcu '%s': timeout of the link", name)
        self._mcu.get_serial().abort_waits()
        self._invoke("Lost communication with MCU '%s'" % (name,), {
            "mcu": name, "reason": "", "event_type": "timeout"})

    def _note_absent(self, reason):
        self._mcu.get_printer().get_reactor().register_async_callback(
            lambda eventtime: self._mcu.note_absent(reason))

    def _handle_shutdown(self, params):
        if self.is_shutdown or self.is_muted:
            return
        self.is_shutdown = True
        mcu = self._mcu
        if "clock" in params:
            self.shutdown_clock = mcu.clock32_to_clock64(params["clock"])
        reason = params["static_string_id"]
        if reason.startswith("?"):
            reason = "unknown reason %s" % (reason[1:],)
        self.shutdown_msg = reason
        logging.info("mcu '%s' %s: %s", mcu.get_name(), params["#name"], reason)
        prefix = "Previous MCU" if params["#name"] == "is_shutdown" else "MCU"
        self._invoke("%s '%s' shutdown: %s" % (prefix, mcu.get_name(), reason), {
            "mcu": mcu.get_name(), "reason": reason, "event_type": params["#name"]})

    def _handle_starting(self, params):
        if self.is_shutdown:
            return
        if absence.may_be_absent(self._mcu):
            self._note_absent("it was reset")
            return
        name = self._mcu.get_name()
        self._mcu.get_serial().abort_waits()
        self._invoke("MCU '%s' spontaneous restart" % (name,), {
            "mcu": name, "reason": "", "event_type": "spontaneous_restart"})

    def _handle_fault(self, message):
        self._invoke(message, {"mcu": self._mcu.get_name(), "reason": message,
                               "event_type": "internal"})

    def _invoke(self, message, details):
        """Shut the printer down, from any thread."""
        self._printer.invoke_async_shutdown(message, details)
