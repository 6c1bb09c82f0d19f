# SPDX-License-Identifier: GPL-3.0-or-later
"""[print_stats]: state, times and filament of the print of a file."""


class PrintStats:
    """Notes what the virtual SD card does, counts time and filament."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode_move = printer.load_object(config, "gcode_move")
        self.reset()
        printer.lookup_object("gcode").register_command(
            "SET_PRINT_STATS_INFO", self.cmd_SET_PRINT_STATS_INFO,
            desc=self.cmd_SET_PRINT_STATS_INFO_help)

    def reset(self):
        """Forget the print."""
        self.filename = self.error_message = ""
        self.state = "standby"
        self.print_start_time = self.last_pause_time = None
        self.total_duration = self.prev_pause_duration = self.init_duration = 0.
        self.filament_used = self.last_epos = 0.
        self.info = {"total_layer": None, "current_layer": None}

    def set_current_file(self, filename):
        """A file was loaded."""
        self.reset()
        self.filename = filename

    def restore(self, status):
        """Count on from what get_status() was before the host ended."""
        now = self.reactor.monotonic()
        self.print_start_time = now - status["total_duration"]
        self.filament_used, self.info = status["filament_used"], status["info"]
        # what was neither printing nor preparation were pauses
        if self.filament_used < 1e-7:
            return
        self.prev_pause_duration = (
            status["total_duration"] - status["print_duration"])

    def note_start(self):
        """The print starts, or goes on after a pause."""
        now = self.reactor.monotonic()
        if self.print_start_time is None:
            self.print_start_time = now
        elif self.last_pause_time is not None:
            self.prev_pause_duration += now - self.last_pause_time
            self.last_pause_time = None
        status = self.gcode_move.get_status(now)
        self.last_epos = status["position"][3]
        self.state, self.error_message = "printing", ""

    def note_pause(self, message=""):
        """The print pauses; message: the error that it pauses for."""
        if self.last_pause_time is None:
            now = self.reactor.monotonic()
            self.last_pause_time = now
            self._update_filament(now)
        if self.state != "error":
            self.state, self.error_message = "paused", message

    def note_complete(self):
        self._finish("complete")

    def note_cancel(self):
        self._finish("cancelled")

    def note_error(self, message):
        self._finish("error", message)

    def _finish(self, state, message=""):
        if self.print_start_time is None:
            return
        self.state, self.error_message = state, message
        now = self.reactor.monotonic()
        self.total_duration = now - self.print_start_time
        if self.filament_used < 1e-7:
            # nothing was extruded: all of it was preparation
            self.init_duration = self.total_duration - self.prev_pause_duration
        self.print_start_time = None

    def _update_filament(self, eventtime):
        status = self.gcode_move.get_status(eventtime)
        epos = status["position"][3]
        factor = status["extrude_factor"] or 1.
        self.filament_used += (epos - self.last_epos) / factor
        self.last_epos = epos

    cmd_SET_PRINT_STATS_INFO_help = "Set the layers that the slicer counts"

    def cmd_SET_PRINT_STATS_INFO(self, gcmd):
        total = gcmd.get_int("TOTAL_LAYER", self.info["total_layer"], minval=0)
        current = gcmd.get_int("CURRENT_LAYER", self.info["current_layer"], minval=0)
        if total == 0:
            total = current = None
        elif total != self.info["total_layer"] and current is None:
            current = 0
        if current is not None and total is not None:
            current = min(current, total)
        self.info = {"total_layer": total, "current_layer": current}

    def get_status(self, eventtime):
        """Durations in s; filament_used in mm; info: layers or None."""
        pause = self.prev_pause_duration
        if self.print_start_time is not None:
            if self.last_pause_time is not None:
                pause += eventtime - self.last_pause_time
            else:
                self._update_filament(eventtime)
            self.total_duration = eventtime - self.print_start_time
            if self.filament_used < 1e-7:
                self.init_duration = self.total_duration - pause
        return {
            "filename": self.filename, "total_duration": self.total_duration,
            "print_duration": self.total_duration - self.init_duration - pause,
            "filament_used": self.filament_used, "state": self.state,
            "message": self.error_message, "info": self.info}


def load_config(config):
    return PrintStats(config)
