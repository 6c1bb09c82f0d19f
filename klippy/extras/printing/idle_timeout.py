# SPDX-License-Identifier: GPL-3.0-or-later
"""[idle_timeout]: knows whether the printer prints, and what to do when idle.

States: Printing while moves are queued or commands run, Ready after that,
Idle once the timeout has passed and its G-code ran.
"""

import logging

DEFAULT_GCODE = """
{% if 'heaters' in printer %}
   TURN_OFF_HEATERS
{% endif %}
M84
"""
READY_TIMEOUT = 0.5     # s without moves until Printing becomes Ready
EVENT_LEAD = 0.1        # s from now to the print_time that events carry


class IdleTimeout:
    """Watches the toolhead and the G-code dispatcher."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.toolhead = self.timer = None
        self.state = "Idle"
        self.last_print_start_systime = 0.
        self.idle_timeout = config.getfloat("timeout", 600., above=0.)
        self.idle_gcode = printer.load_object(config, "gcode_macro").load_template(
            config, "gcode", DEFAULT_GCODE)
        printer.register_event_handler("klippy:ready", self._handle_ready)
        printer.register_event_handler("klippy:disconnect", self._stop)
        self.gcode.register_command(
            "SET_IDLE_TIMEOUT", self.cmd_SET_IDLE_TIMEOUT,
            desc=self.cmd_SET_IDLE_TIMEOUT_help)

    def _handle_ready(self):
        self.toolhead = self.printer.lookup_object("toolhead")
        self.timer = self.reactor.register_timer(self._check)
        self.printer.register_event_handler("toolhead:sync_print_time",
                                            self._note_moves)

    def _stop(self):
        if self.timer is not None:
            self.reactor.unregister_timer(self.timer)
            self.timer = None

    def get_status(self, eventtime):
        """state; printing_time in s since Printing began; idle_timeout in s."""
        printing_time = 0.
        if self.state == "Printing":
            printing_time = eventtime - self.last_print_start_systime
        return {"state": self.state, "printing_time": printing_time,
                "idle_timeout": self.idle_timeout}

    def _note_moves(self, eventtime, est_print_time, print_time):
        """The toolhead starts to move after a rest."""
        if self.state == "Printing" or self.timer is None:
            return
        self.state = "Printing"
        self.last_print_start_systime = eventtime
        check_time = READY_TIMEOUT + max(0., print_time - est_print_time)
        self.reactor.update_timer(self.timer, eventtime + check_time)
        self.printer.send_event("idle_timeout:printing", est_print_time + EVENT_LEAD)

    def _check(self, eventtime):
        if self.printer.is_shutdown():
            return self.reactor.NEVER
        if self.state == "Printing":
            return self._check_ready(eventtime)
        return self._check_idle(eventtime)

    def _get_idle_time(self, eventtime):
        """(s since the last move ended, negative before that; est_print_time);
        None instead of the time while moves are waiting to be planned."""
        print_time, est_print_time, is_lookahead_empty = \
            self.toolhead.check_busy(eventtime)
        idle_time = est_print_time - print_time if is_lookahead_empty else None
        return idle_time, est_print_time

    def _check_ready(self, eventtime):
        """Printing becomes Ready when nothing moves and no command runs."""
        idle_time, est_print_time = self._get_idle_time(eventtime)
        if idle_time is None:
            return eventtime + READY_TIMEOUT
        if idle_time < READY_TIMEOUT:
            return eventtime + READY_TIMEOUT - min(0., idle_time)
        if self.gcode.get_mutex().test():
            return eventtime + READY_TIMEOUT
        self.state = "Ready"
        self.printer.send_event("idle_timeout:ready", est_print_time + EVENT_LEAD)
        return eventtime + self.idle_timeout

    def _check_idle(self, eventtime):
        """Ready becomes Idle when the timeout has passed."""
        idle_time, _ = self._get_idle_time(eventtime)
        if self.state == "Idle":
            return self.reactor.NEVER
        if idle_time is None or self.gcode.get_mutex().test():
            return eventtime + min(1., self.idle_timeout)
        if idle_time < self.idle_timeout:
            return eventtime + max(0.001, self.idle_timeout - idle_time)
        self._enter_idle()
        return self.reactor.NEVER

    def _enter_idle(self):
        # moves of the script itself are no print
        self.state = "Printing"
        try:
            self.gcode.run_script(self.idle_gcode.render())
        except self.gcode.error as err:
            logging.error("[idle_timeout] gcode failed: %s", err)
        self.state = "Idle"
        self.printer.send_event("idle_timeout:idle",
                                self.toolhead.get_last_move_time())

    cmd_SET_IDLE_TIMEOUT_help = "Set the time until the printer goes idle"

    def cmd_SET_IDLE_TIMEOUT(self, gcmd):
        timeout = gcmd.get_float("TIMEOUT", self.idle_timeout, above=0.)
        self.idle_timeout = timeout
        gcmd.respond_info("idle_timeout: Timeout set to %.2f s" % (timeout,))
        if self.state == "Ready" and self.timer is not None:
            self.reactor.update_timer(self.timer,
                                      self.reactor.monotonic() + timeout)


def load_config(config):
    return IdleTimeout(config)
