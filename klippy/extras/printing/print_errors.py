# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of a print when one of its lines fails.

on_command_error: `pause` lets the user decide, `skip` goes on with the next
line, `stop` runs on_error_gcode and ends the print.
"""

import logging

from klippy.errors import CommandError, PrinterError
from klippy.extras.sd_stream import ReadError

ACTIONS = {"pause": "pause", "skip": "skip", "stop": "stop"}
# So many failed lines without a good one between them are no slip
MAX_SKIPPED_IN_A_ROW = 20
# Characters by which a line is known that an error quotes in part
SAID = 60
DEFAULT_ERROR_GCODE = """
{% if 'heaters' in printer %}
   TURN_OFF_HEATERS
{% endif %}
"""


class ErrorPolicy:
    """Tells the failures of a print's lines and does what the config asks."""

    def __init__(self, config, sdcard):
        self.printer = printer = config.get_printer()
        self.sdcard = sdcard
        self.gcode = printer.lookup_object("gcode")
        has_gcode = config.get("on_error_gcode", None, note_valid=False) is not None
        self.action = config.getchoice("on_command_error", ACTIONS,
                                       "stop" if has_gcode else "pause")
        self.on_error_gcode = printer.load_object(
            config, "gcode_macro").load_template(
                config, "on_error_gcode", DEFAULT_ERROR_GCODE)
        self.reset()

    def reset(self):
        """Another file is printed."""
        self.skipped_lines = self.n_in_a_row = 0
        self.next_line = -1             # byte behind the last skipped line

    def handle(self, err, stream, filename):
        """A line of the file failed; runs within the work on the file.

        Returns (whether the print is at its end, text of the error; empty if
        the print just goes on).
        """
        text = describe(err, stream, filename)
        self.gcode.report_error(CommandError(text))
        if self.printer.is_shutdown():
            return True, text
        if self.action == "stop":
            self._try_run(self.on_error_gcode.run_gcode_from_command)
            return True, text
        if self.action == "skip" and self._can_skip(err, stream):
            self._skip_line(stream)
            return False, ""
        if not isinstance(err, ReadError):
            stream.pass_line()
        self._pause()
        return False, text

    def handle_interruption(self, text):
        """The line that text tells was ended, but not the print: pause it.

        Returns what handle() does.
        """
        self.gcode.report_error(CommandError(text))
        self._pause()
        return False, text

    def _can_skip(self, err, stream):
        if not isinstance(err, CommandError) or isinstance(err, ReadError):
            return False
        if stream.position != self.next_line:
            self.n_in_a_row = 0
        self.n_in_a_row += 1
        if self.n_in_a_row <= MAX_SKIPPED_IN_A_ROW:
            return True
        self.n_in_a_row = 0
        self.gcode.respond_info("%d lines in a row failed: the print pauses"
                                % (MAX_SKIPPED_IN_A_ROW + 1,))
        return False

    def _skip_line(self, stream):
        stream.pass_line()
        self.next_line = stream.position
        self.skipped_lines += 1

    def _pause(self):
        pause_resume = self.printer.lookup_object("pause_resume", None)
        if pause_resume is not None:
            self._try_run(pause_resume.pause_within_command)
        self.sdcard.do_pause()

    def _try_run(self, func):
        try:
            func()
        except PrinterError as err:
            logging.error("virtual_sdcard: the answer to an error failed: %s", err)
            self.gcode.report_error(err)


def describe(err, stream, filename):
    """Text of an error with the place and the words of the line that failed."""
    first, separator, rest = str(err).partition("\n")
    number, line = stream.find_failed_line()
    if line[:SAID] not in first:
        first += " (in '%s')" % (line,)
    place = "%s:%d" % (filename, number) if number else filename
    return "%s: %s%s%s" % (place, first or "unknown error", separator, rest)
