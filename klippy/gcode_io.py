# SPDX-License-Identifier: GPL-3.0-or-later
"""G-code from outside: the terminal (a pty) and the file of a batch run.

The terminal acknowledges each line with ok and tells a waiting sender that the
printer is busy; M112 is obeyed even while another command runs.
"""

import errno
import logging
import os
import re
import termios
import tty

from klippy.errors import PrinterError

BLOCK_SIZE = 128 * 1024
MAX_LINE = 1024 * 1024          # bytes without a newline that are kept
MAX_PENDING_LINES = 1000        # terminal: stop reading beyond
BUSY_PERIOD = 2.0               # s between busy lines, unless M113 says another
_EMERGENCY = re.compile(rb"(?:^|\n)\s*(?:[Nn]\d+\s*)?[Mm]112(?![0-9.])")


def create_terminal(path):
    """Open a raw pty whose other side has a link at path; returns its fd.

    Raises OSError.
    """
    master, slave = os.openpty()
    try:
        target = os.ttyname(slave)
        if os.path.islink(path):
            os.remove(path)
        os.symlink(target, path)
        os.chmod(target, 0o660)
        tty.setraw(slave, termios.TCSANOW)
        attributes = termios.tcgetattr(slave)
        attributes[3] &= ~(termios.ECHO | termios.ICANON)
        termios.tcsetattr(slave, termios.TCSADRAIN, attributes)
    except OSError:
        os.close(master)
        os.close(slave)
        raise
    os.set_blocking(master, False)
    return master


def remove_terminal(path, target):
    """Remove the link that create_terminal() made, if it still leads to target.

    Left behind it would lead to whoever is given that pty next.
    """
    try:
        if os.readlink(path) == target:
            os.remove(path)
    except OSError:
        pass        # gone already, or another's file


class LineSplitter:
    """Cuts a stream of bytes into lines of bounded length."""

    def __init__(self):
        self.rest = b""
        self.is_skipping = False        # inside a line that is too long

    def feed(self, data):
        """Complete lines (bytes, without newline); None stands for a line that
        was too long."""
        lines = (self.rest + data).split(b"\n")
        self.rest = lines.pop()
        if self.is_skipping and lines:
            lines[0], self.is_skipping = None, False
        if len(self.rest) > MAX_LINE:
            self.rest, self.is_skipping = b"", True
        return lines


class Terminal:
    """Lines from a tty, run one after the other."""

    def __init__(self, printer, gcode, fd):
        self.printer, self.gcode, self.fd = printer, gcode, fd
        self.reactor = printer.get_reactor()
        self.splitter = LineSplitter()
        self.pending, self.is_running = [], False
        self.bytes_read = 0
        self.busy_period = BUSY_PERIOD
        gcode.register_command("M113", self.cmd_M113, True)
        self.busy_timer = self.reactor.register_timer(self._tell_busy)
        self.handler = self.reactor.register_fd(fd, self._read)
        gcode.register_output_handler(self._respond)
        printer.register_event_handler("klippy:disconnect", self.close)

    def close(self):
        """Stop reading; the descriptor stays with its owner."""
        if self.handler is not None:
            self.reactor.unregister_fd(self.handler)
            self.handler = None
            self.gcode.output_callbacks.remove(self._respond)

    def _read(self, eventtime):
        try:
            data = os.read(self.fd, 4096)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as err:
            if err.errno != errno.EIO:
                logging.exception("G-code terminal: reading failed")
                self.close()
            return
        self.bytes_read += len(data)
        if self.is_running and _EMERGENCY.search(self.splitter.rest + data):
            self.gcode.core_commands.cmd_M112(None)
        lines = self.splitter.feed(data)
        if self.is_running:
            self._note_arrivals(lines)
        self.pending.extend(lines)
        if len(self.pending) > MAX_PENDING_LINES:
            # this sender does not wait for ok
            self.reactor.set_fd_wake(self.handler, False)
        if not self.is_running:
            self._run_pending()

    def _note_arrivals(self, lines):
        """Some commands do part of their work while another one runs."""
        for line in lines:
            if line:
                self.gcode.interrupts.note_arrival(line.decode("utf-8", "replace"))

    def _run_pending(self):
        self.is_running = True
        self._arm_busy_timer()
        try:
            while self.pending and self.handler is not None:
                self._run_line(self.pending.pop(0))
                self._arm_busy_timer()
        finally:
            self.is_running = False
            self.reactor.update_timer(self.busy_timer, self.reactor.NEVER)
            if self.handler is not None:
                self.reactor.set_fd_wake(self.handler, True)

    def _run_line(self, line):
        if line is None:
            self.gcode.respond_error("A line of more than %d bytes was dropped"
                                     % (MAX_LINE,))
            self.gcode.respond_raw("ok")
            return
        self.gcode.run_terminal_line(line.decode("utf-8", "replace"))

    def cmd_M113(self, gcmd):
        """Set the seconds between busy lines, 0 for none; without S tell them."""
        period = gcmd.get_float("S", None, minval=0., maxval=3600.)
        if period is None:
            gcmd.respond_info("M113 S%g" % (self.busy_period,), log=False)
            return
        self.busy_period = period
        if self.is_running:
            self._arm_busy_timer()

    def _arm_busy_timer(self):
        now, period = self.reactor.monotonic(), self.busy_period
        self.reactor.update_timer(self.busy_timer,
                                  now + period if period else self.reactor.NEVER)

    def _tell_busy(self, eventtime):
        self._respond("echo:busy: processing")
        return eventtime + self.busy_period

    def _respond(self, text):
        """Write a response; dropped when the other side does not read."""
        try:
            os.write(self.fd, (text + "\n").encode("utf-8", "replace"))
        except (BlockingIOError, InterruptedError):
            return
        except OSError as err:
            if err.errno != errno.EIO:
                logging.exception("G-code terminal: writing failed")

    def stats(self, eventtime):
        return False, "gcodein=%d" % (self.bytes_read,)


class BatchInput:
    """The G-code file of a batch run: runs it all, then ends the host.

    The first command error ends the run with result error_exit.
    """

    def __init__(self, printer, gcode, fd):
        self.printer, self.gcode, self.fd = printer, gcode, fd
        self.bytes_read = 0
        printer.register_event_handler("klippy:ready", self._handle_ready)

    def _handle_ready(self):
        self.printer.get_reactor().register_callback(self._run)

    def _run(self, eventtime):
        result = "exit"
        try:
            self._run_blocks()
        except PrinterError as err:
            self.gcode.report_error(err)
            result = "error_exit"
        except OSError as err:
            self.gcode.respond_error("Unable to read the G-code: %s" % (err,))
            result = "error_exit"
        self.printer.send_event("gcode:debuginput_exit")
        if self.printer.is_shutdown():
            result = "error_exit"
        self.printer.request_exit(result)

    def _run_blocks(self):
        runner, rest = self.gcode.runner, b""
        with self.gcode.get_mutex():
            while not self.printer.is_shutdown():
                data = os.read(self.fd, BLOCK_SIZE)
                self.bytes_read += len(data)
                # the end of the file ends its last line
                rest = self._run_block(runner, rest + (data or b"\n"))
                if not data:
                    return
                if len(rest) > MAX_LINE:
                    raise self.gcode.error(
                        "A G-code line of more than %d bytes before byte %d"
                        % (MAX_LINE, self.bytes_read))

    def _run_block(self, runner, block):
        """Run the complete lines of a block; returns what follows them."""
        pos = 0
        while True:
            end = runner.find_next(block, pos)
            if end < 0:
                return block[pos:]
            runner.run_found(block, pos, end)
            pos = end
            if self.printer.is_shutdown():
                return b""

    def stats(self, eventtime):
        return False, "gcodein=%d" % (self.bytes_read,)


def setup(printer):
    """Connect the G-code source that the start arguments name, if any.

    Comes after gcode.setup(); the object is called `gcode_io`.
    """
    start_args = printer.get_start_args()
    gcode, fd = printer.lookup_object("gcode"), start_args.get("gcode_fd")
    if start_args.get("debuginput"):
        if fd is None:
            fd = os.open(start_args["debuginput"], os.O_RDONLY)
        source = BatchInput(printer, gcode, fd)
    elif fd is not None:
        source = Terminal(printer, gcode, fd)
    else:
        return None
    printer.add_object("gcode_io", source)
    return source
