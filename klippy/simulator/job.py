# SPDX-License-Identifier: GPL-3.0-or-later
"""One job on a simulated printer: start it when ready, watch it, sum it up."""
import logging
import os
from dataclasses import dataclass, field

from klippy.errors import PrinterError
from klippy.simulator import progress

WATCH_PERIOD = 0.5
FINAL_STATES = ("complete", "cancelled", "error")
# s a pause may last that nobody can end from outside
PAUSE_TIMEOUT = 3600.0
# A printer that is not ready after this long never will be.
START_TIMEOUT = 120.0


@dataclass
class JobResult:
    """How a job ended; durations in s, filament in mm."""

    is_ok: bool = False
    message: str = ""
    print_duration: float = 0.0
    total_duration: float = 0.0
    filament_used: float = 0.0
    min_margin: float | None = None
    stalls: int = 0
    final_position: tuple | None = None
    stats: dict = field(default_factory=dict)


class SimJob:
    """Prints one file on one printer and calls finish(JobResult) at its end.

    Everything runs on the printer's reactor, in virtual time.
    """

    def __init__(self, printer, machine, path, display, recorder, finish,
                 has_users=False):
        """has_users: somebody may have a paused print go on."""
        self.printer = printer
        self.machine = machine
        self.path = os.path.abspath(path)
        self.display = display
        self.recorder = recorder
        self.finish = finish
        self.layers = progress.LayerIndex(self.path)
        self.result = JobResult()
        self.is_started = self.is_finished = False
        self.pause_start = None         # eventtime
        self.has_users = has_users
        self.reactor = printer.get_reactor()
        self.deadline = self.reactor.monotonic() + START_TIMEOUT
        self.timer = self.reactor.register_timer(
            self._watch, self.reactor.monotonic() + WATCH_PERIOD)
        printer.register_event_handler("klippy:ready", self._handle_ready)

    # Start

    def _handle_ready(self):
        self.reactor.register_callback(self._start)

    def _start(self, eventtime):
        sdcard = self.printer.lookup_object("virtual_sdcard")
        sdcard.sdcard_dirname = os.path.dirname(self.path)
        gcode = self.printer.lookup_object("gcode")
        name = os.path.basename(self.path)
        if self.recorder is not None:
            self.recorder.is_on = True
        self.is_started = True
        try:
            gcode.run_script('SDCARD_PRINT_FILE FILENAME="%s"' % name)
        except PrinterError as e:
            self._end(False, str(e))

    # Watch

    def _watch(self, eventtime):
        if self.is_finished:
            return self.reactor.NEVER
        message, category = self.printer.get_state_message()
        if category in ("error", "shutdown"):
            self._end(False, message)
        elif self.is_started:
            self._note_progress(eventtime)
        elif eventtime > self.deadline:
            self._end(False, "The printer was not ready after %.0f s: %s"
                      % (START_TIMEOUT, message))
        if self.is_finished:
            return self.reactor.NEVER
        return eventtime + WATCH_PERIOD

    def _note_progress(self, eventtime):
        status = self.printer.lookup_object("print_stats").get_status(eventtime)
        heaters = self._read_heaters(eventtime)
        self._note_margin(eventtime, status, heaters)
        if self.display is not None and self.display.is_due():
            self.display.update(
                eventtime, self._make_snapshot(eventtime, status, heaters))
        if status["state"] in FINAL_STATES:
            self._conclude(status)
        elif status["state"] == "paused":
            self._note_paused(eventtime, status)
        else:
            self.pause_start = None

    def _note_paused(self, eventtime, status):
        """A pause ends the job, unless somebody may still have it go on."""
        message = status["message"]
        if self.pause_start is None:
            self.pause_start = eventtime
            if self.has_users and self.display is not None:
                self.display.write_message("Paused; RESUME goes on, CANCEL_PRINT ends"
                                           " the print. %s" % (message,))
        if self.has_users:
            return
        if message:
            self._conclude(status)
        elif eventtime > self.pause_start + PAUSE_TIMEOUT:
            self._conclude(dict(status, message=(
                "The print paused, and nothing had it go on for %.0f s: take PAUSE"
                " out of the file, or serve the API socket and send RESUME"
                % (PAUSE_TIMEOUT,))))

    def _note_margin(self, eventtime, status, heaters):
        margin = self.calc_margin(eventtime)
        # Only a machine that is busy printing can run short of steps.
        if status["filament_used"] > 0.0 and status["state"] == "printing":
            low = self.result.min_margin
            self.result.min_margin = margin if low is None else min(low, margin)
        if self.recorder is not None:
            self.recorder.note_state(eventtime, margin, heaters)

    def calc_margin(self, eventtime):
        """Seconds by which the planned moves reach ahead of the mcu."""
        toolhead = self.printer.lookup_object("toolhead")
        print_time, est_print_time, _ = toolhead.check_busy(eventtime)
        return max(print_time - est_print_time, 0.0)

    def _read_heaters(self, eventtime):
        heaters = self.printer.lookup_object("heaters", None)
        if heaters is None:
            return {}
        return {name: heaters.lookup_heater(name.split()[-1]).get_temp(eventtime)
                for name in heaters.get_all_heaters()}

    def _make_snapshot(self, eventtime, status, heaters):
        sdcard = self.printer.lookup_object("virtual_sdcard")
        sd_status = sdcard.get_status(eventtime)
        return progress.Snapshot(
            filename=os.path.basename(self.path), state=status["state"],
            fraction=sd_status["progress"],
            layer=self.layers.lookup(sd_status["file_position"]),
            n_layers=len(self.layers), position=self.machine.calc_position(),
            elapsed=status["total_duration"], heaters=heaters)

    # End

    def _conclude(self, status):
        self.result.print_duration = status["print_duration"]
        self.result.total_duration = status["total_duration"]
        self.result.filament_used = status["filament_used"]
        if status["state"] != "complete":
            self._end(False, status["message"] or "Print " + status["state"])
            return
        self.is_finished = True
        self.reactor.register_callback(self._wait_for_moves)

    def _wait_for_moves(self, eventtime):
        try:
            self.printer.lookup_object("toolhead").wait_moves()
        except PrinterError as e:
            self._end(False, str(e))
            return
        if self.printer.is_shutdown():
            self._end(False, self.printer.get_state_message()[0])
        else:
            self._end(True, "complete")

    def _end(self, is_ok, message):
        self.is_finished = True
        if self.recorder is not None:
            self.recorder.is_on = False
        self.result.is_ok, self.result.message = is_ok, message
        self.result.final_position = self.machine.calc_position()
        toolhead = self.printer.lookup_object("toolhead", None)
        if toolhead is not None:
            status = toolhead.get_status(self.reactor.monotonic())
            self.result.stalls = status.get("stalls", 0)
        logging.info("Simulated job ended: %s", message)
        self.finish(self.result)
