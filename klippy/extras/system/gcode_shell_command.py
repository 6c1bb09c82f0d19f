# SPDX-License-Identifier: GPL-3.0-or-later
"""[gcode_shell_command <name>]: RUN_SHELL_COMMAND runs a program of the computer.

The program runs in a session of its own, is served by a thread, and gets what the
config says and PARAMS as arguments; no shell is involved.  The G-code waits for
its end; the reactor, and with it the motion, goes on.
"""

import os
import select
import shlex
import signal
import subprocess
import threading

from klippy.errors import CommandInterrupted
from klippy_ext.hostclock import RealClock

POLL_INTERVAL = 0.05        # s, between looks at a process that says nothing
GRACE = 0.5                 # s from the request to end to the kill
MAX_OUTPUT = 65536          # bytes that are shown of one run
CHUNK = 4096


class ShellRun:
    """One run of a program, on a thread; tell(text) and end(outcome) are called there.

    outcome: exit status (negative: signal), or a text if there is none.
    """

    def __init__(self, arguments, timeout, tell, end):
        self.arguments, self.timeout = arguments, timeout
        self.tell, self.end = tell, end
        self.clock = RealClock()        # also in a virtual world
        self.is_cancelled = False
        self.n_bytes, self.rest = 0, b""
        threading.Thread(target=self._run, name="shell", daemon=True).start()

    def cancel(self):
        """Have the program ended.  Any thread."""
        self.is_cancelled = True

    def _run(self):
        try:
            process = subprocess.Popen(
                self.arguments, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, start_new_session=True)
        except OSError as err:
            self.end("it cannot be run: %s" % (err.strerror,))
            return
        with process.stdout as pipe:
            outcome = self._serve(process, pipe.fileno())
        self.end(outcome)

    def _serve(self, process, fd):
        """Pass output on until the process ends or must end; returns the outcome."""
        os.set_blocking(fd, False)
        limit = self.clock.monotonic() + self.timeout
        is_open = True
        while process.poll() is None:
            if self.is_cancelled or self.clock.monotonic() >= limit:
                end_group(process)
                self._read(fd)
                return "it was ended" if self.is_cancelled else (
                    "it took more than %g s and was ended" % (self.timeout,))
            if is_open:
                select.select([fd], [], [], POLL_INTERVAL)
                is_open = self._read(fd)
            else:
                self._wait(process)
        self._read(fd)
        if self.rest:
            self._tell(self.rest)
        return process.returncode

    @staticmethod
    def _wait(process):
        try:
            process.wait(POLL_INTERVAL)
        except subprocess.TimeoutExpired:
            return

    def _read(self, fd):
        """Pass on the lines there are; False at the end of all output."""
        for _ in range(MAX_OUTPUT // CHUNK):
            try:
                data = os.read(fd, CHUNK)
            except BlockingIOError:
                return True
            if not data:
                return False
            lines, is_line, rest = (self.rest + data).rpartition(b"\n")
            self.rest = rest[-CHUNK:]
            if is_line:
                self._tell(lines)
        return True

    def _tell(self, data):
        if self.n_bytes > MAX_OUTPUT:
            return
        self.n_bytes += len(data)
        self.tell(data[:MAX_OUTPUT].decode("utf-8", "replace"))
        if self.n_bytes > MAX_OUTPUT:
            self.tell("(further output is not shown)")


def end_group(process):
    """End a process with all of its group."""
    for number, patience in ((signal.SIGTERM, GRACE), (signal.SIGKILL, None)):
        try:
            os.killpg(process.pid, number)
        except ProcessLookupError:
            break
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            continue
    process.wait()


class ShellCommand:
    """A program that G-code may run."""

    def __init__(self, config):
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.name = config.get_name().split()[-1]
        self.arguments = self._split(config)
        self.timeout = config.getfloat("timeout", 2., above=0.)
        self.is_verbose = config.getboolean("verbose", True)
        self.runs = []
        self.gcode.register_mux_command(
            "RUN_SHELL_COMMAND", "CMD", self.name, self.cmd_RUN_SHELL_COMMAND,
            desc=self.cmd_RUN_SHELL_COMMAND_help)
        printer.register_event_handler("klippy:disconnect", self._cancel_all)

    @staticmethod
    def _split(config):
        text = config.get("command")
        try:
            arguments = [os.path.expanduser(word) for word in shlex.split(text)]
        except ValueError as err:
            raise config.error("option 'command' in section [%s]: '%s': %s"
                               % (config.get_name(), text, err))
        if not arguments:
            raise config.error("option 'command' in section [%s] is empty"
                               % (config.get_name(),))
        return arguments

    def _cancel_all(self):
        for run in self.runs:
            run.cancel()

    cmd_RUN_SHELL_COMMAND_help = "Run a program of the computer, wait for its end"

    def cmd_RUN_SHELL_COMMAND(self, gcmd):
        try:
            more = shlex.split(gcmd.get("PARAMS", ""))
        except ValueError as err:
            raise gcmd.error("RUN_SHELL_COMMAND PARAMS: %s" % (err,))
        if any("\0" in word for word in more):
            raise gcmd.error("RUN_SHELL_COMMAND PARAMS holds a NUL character")
        if self.printer.get_start_args().get("debugoutput") is not None:
            gcmd.respond_info("Command %s is not run in a batch run" % (self.name,))
            return
        if self.is_verbose:
            gcmd.respond_info("Running command %s" % (self.name,))
        outcome = self._run(self.arguments + more)
        if outcome != 0:
            text = outcome if isinstance(outcome, str) else (
                "it ended with status %d" % (outcome,))
            gcmd.respond_info("Command %s: %s" % (self.name, text))
        elif self.is_verbose:
            gcmd.respond_info("Command %s finished" % (self.name,))

    def _run(self, arguments):
        """Run a program; returns its outcome.  Raises CommandInterrupted."""
        outcomes = []
        with self.gcode.interrupts.waiting() as wait:
            def note(outcome):
                outcomes.append(outcome)
                wait.wake()

            run = ShellRun(
                arguments, self.timeout, self._tell, lambda outcome:
                self.reactor.register_async_callback(lambda eventtime: note(outcome)))
            self.runs.append(run)
            try:
                while not outcomes and not wait.is_ended:
                    wait.pause(self.reactor.NEVER)
            except CommandInterrupted:
                run.cancel()
                raise
            finally:
                self.runs.remove(run)
            if not outcomes:
                run.cancel()
        return outcomes[0] if outcomes else "it was ended"

    def _tell(self, text):
        if self.is_verbose:
            self.reactor.register_async_callback(
                lambda eventtime: self.gcode.respond_info(text))


def load_config_prefix(config):
    return ShellCommand(config)
