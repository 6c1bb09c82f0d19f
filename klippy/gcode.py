# SPDX-License-Identifier: GPL-3.0-or-later
"""G-code front end: from a line of text to the handler of its command.

A plain G0/G1 line goes from the scanner straight to the move sink; every other
line becomes a GCodeCommand.  Errors are raised to the outermost caller, which
reports each of them once.  See docs/internals/gcode.md.
"""

import logging
import os
import re
import traceback

from klippy import gcode_builtin
from klippy.errors import CommandError, CommandInterrupted, PrinterError
from klippy.gcode_command import (
    REQUIRED,
    Coord,
    GCodeCommand,
    is_classic,
    shorten,
)
from klippy.gcode_run import Interrupts, Run, find_label
from klippy.slownote import SLOW_TIME
from klippy_ext.gscan import MoveScan

__all__ = ["Coord", "GCodeCommand", "GCodeDispatch", "LineRunner", "MoveSink",
           "ScriptMutex", "CommandError", "get", "setup"]

_HEAD = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_.]*)")
_CLASSIC_HEAD = re.compile(r"([A-Za-z])0*(\d+(?:\.\d+)?)")
_EXTENDED_NAME = re.compile(r"[A-Z_][A-Z0-9_]*\Z")
_LINE_NUMBER = re.compile(r"\s*[Nn](\d+)\s*(?=[A-Za-z*]|\Z)")
_CHECKSUM = re.compile(r"(.*)\*(\d+)\s*(?:;.*)?\Z", re.DOTALL)


class MoveSink:
    """Taker of plain moves; the owner of the G-code coordinates derives it."""

    def move_line(self, scan):
        """Carry out the move whose words scan holds.

        scan: MoveScan, valid until the first wait.  May wait.
        Raises CommandError if the move is not possible.
        """
        raise NotImplementedError("a move sink must define move_line()")


class ScriptMutex:
    """Mutex of the running commands, which knows who runs and who waits.

    runs: the Run that holds it first, then those that wait in their order.
    """

    def __init__(self, mutex):
        self._mutex = mutex
        self.n_waiting = 0
        self.runs = []

    def test(self):
        """True while commands run."""
        return self._mutex.test()

    def lock(self):
        """Wait until no other commands run, in order of arrival."""
        self.lock_run(Run())

    def lock_run(self, run):
        """As lock(), for a Run that others may know."""
        self.runs.append(run)
        self.n_waiting += 1
        try:
            self._mutex.lock()
        except BaseException:
            self.runs.remove(run)
            raise
        finally:
            self.n_waiting -= 1
        run.is_holding = True

    def unlock(self):
        self.runs.pop(0).is_holding = False
        self._mutex.unlock()

    def find_own_run(self):
        """The Run that holds the mutex, if it is one of this greenlet."""
        run = self.runs[0] if self.runs else None
        return run if run is not None and run.is_own() else None

    def __enter__(self):
        self.lock()

    def __exit__(self, kind, value, trace):
        self.unlock()


class LineRunner:
    """Runs single lines: moves to the sink, the rest to the dispatcher.

    The sink is used only while G0 and G1 have the handlers they had when it
    was set, so that whoever re-registers them sees every move.
    """

    def __init__(self, dispatch):
        self.dispatch = dispatch
        self.scan = MoveScan()
        self.sink = None
        self.sink_g0 = self.sink_g1 = None

    def set_sink(self, sink, g0, g1):
        """Send moves to sink while g0 and g1 are the commands' handlers."""
        self.sink, self.sink_g0, self.sink_g1 = sink, g0, g1

    def _is_sink_active(self):
        handlers = self.dispatch.gcode_handlers
        return (self.sink is not None and handlers.get("G1") is self.sink_g1
                and handlers.get("G0") is self.sink_g0)

    def find_next(self, block, pos):
        """Scan the line of block (bytes) that starts at pos.

        Returns the position behind it, -1 if no newline follows.
        """
        return self.scan.next_line(block, pos)

    def run_found(self, block, pos, end):
        """Run the line that find_next() has just found from pos to end.

        The caller holds the G-code mutex.  Raises CommandError.
        """
        if self.scan.matched and self._is_sink_active():
            self._run_move(None)
        else:
            line = block[pos:end].decode("utf-8", "replace")
            self.dispatch.run_parsed_line(line, False)
        return 0

    def run_line(self, line, need_ack):
        """Run one line of text; with need_ack answer ok when it is done."""
        if self.scan.scan(line) and self._is_sink_active():
            self._run_move(line)
            if need_ack:
                self.dispatch.respond_raw("ok")
        else:
            self.dispatch.run_parsed_line(line, need_ack)
        return 0

    def _run_move(self, line):
        try:
            self.sink.move_line(self.scan)
        except PrinterError:
            raise
        except Exception as exc:
            raise self.dispatch.make_internal_error(exc, line or "G1")
        return 0


def make_refusal(func, reason):
    """A handler that raises an error, unless func's command is harmless."""
    is_harmless = getattr(func, "is_harmless", None)

    def refuse(gcmd):
        if is_harmless is None or not is_harmless(gcmd):
            raise gcmd.error(reason)
        func(gcmd)
    return refuse


class GCodeDispatch:
    """Registry of the G-code commands and runner of scripts."""
    error = CommandError
    Coord = Coord

    def __init__(self, printer):
        self.printer = printer
        start_args = printer.get_start_args()
        self.is_fileinput = bool(start_args.get("debuginput"))
        self.reactor = printer.get_reactor()
        self.mutex = ScriptMutex(self.reactor.mutex())
        self.interrupts = Interrupts(self.reactor, self.mutex)
        self.is_printer_ready = False
        self.output_callbacks = []
        self.base_gcode_handlers = self.gcode_handlers = {}
        self.ready_gcode_handlers = {}
        self.mux_commands, self.gcode_help = {}, {}
        self.section_handlers = {}      # section that was loaded -> its handlers
        self.yielding = set()           # commands that give way to others
        self.status_commands, self.told_commands = None, set()
        self.runner = LineRunner(self)
        self.core_commands = gcode_builtin.CoreCommands(printer, self)
        printer.register_event_handler("klippy:ready", self._handle_ready)
        printer.register_event_handler("klippy:shutdown", self._handle_shutdown)
        printer.register_event_handler("klippy:disconnect", self._handle_disconnect)

    # Registration

    def is_traditional_gcode(self, cmd):
        """True for a letter with a number, like G1."""
        return is_classic(cmd)

    def register_command(self, cmd, func, when_not_ready=False, desc=None,
                         yields=False):
        """Make func(gcmd) the handler of cmd; None takes the handler away.

        yields: give way to whoever else registers cmd, now or later: a macro of that
        name needs no rename_existing.  For commands that other hosts lack.
        Returns the handler taken away.  Raises ConfigError if cmd has one.
        """
        if func is not None:
            self._note_section(func)
        return self._register(cmd, func, when_not_ready, desc, yields)

    def _register(self, cmd, func, when_not_ready, desc, yields):
        if func is None:
            old = self.ready_gcode_handlers.pop(cmd, None)
            self.base_gcode_handlers.pop(cmd, None)
            self.yielding.discard(cmd)
            self.status_commands = None
            return old
        if cmd in self.ready_gcode_handlers and yields:
            return None
        if cmd in self.yielding:
            self._register(cmd, None, False, None, False)
            self.gcode_help.pop(cmd, None)
            self.mux_commands.pop(cmd, None)
        if cmd in self.ready_gcode_handlers:
            raise self.printer.config_error(
                "G-code command %s is already registered" % (cmd,))
        if not is_classic(cmd) and not _EXTENDED_NAME.match(cmd):
            raise self.printer.config_error(
                "'%s' is no name for a G-code command: use capital letters, digits"
                " and _, no digit first" % (cmd,))
        self.ready_gcode_handlers[cmd] = func
        if yields:
            self.yielding.add(cmd)
        if when_not_ready:
            self.base_gcode_handlers[cmd] = func
        if desc is not None:
            self.gcode_help[cmd] = desc
        self.status_commands = None
        return None

    def register_mux_command(self, cmd, key, value, func, desc=None, yields=False):
        """Make func the handler of cmd where parameter key is value.

        value None: func also takes the calls without the parameter.  yields: as of
        register_command().
        """
        known = self.mux_commands.get(cmd)
        if known is None:
            def run_selected(gcmd):
                self._run_mux_command(cmd, gcmd)
            self._register(cmd, run_selected, False, desc, yields)
            known = self.mux_commands[cmd] = (key, {})
        known_key, handlers = known
        if known_key != key:
            raise self.printer.config_error(
                "G-code command %s is selected by %s, not by %s"
                % (cmd, known_key, key))
        if value in handlers:
            raise self.printer.config_error(
                "G-code command %s %s=%s is already registered" % (cmd, key, value))
        handlers[value] = func
        self._note_section(func)

    def _note_section(self, func):
        """Note whose handler it is."""
        find_loading = getattr(self.printer, "find_loading", None)
        section = find_loading() if find_loading is not None else None
        if section is not None and section.may_lack:
            self.section_handlers.setdefault(section.name, []).append(func)

    def block_section(self, section, reason):
        """Have the commands that a section of the config registered raise an error.

        A handler may have an attribute is_harmless(gcmd): with what it lets pass, it
        is called.
        """
        funcs = self.section_handlers.get(section, ())
        for handlers in (self.ready_gcode_handlers, self.base_gcode_handlers,
                         *(table for _, table in self.mux_commands.values())):
            for key, func in handlers.items():
                if func in funcs:
                    handlers[key] = make_refusal(func, reason)

    def _run_mux_command(self, cmd, gcmd):
        key, handlers = self.mux_commands[cmd]
        value = gcmd.get(key, None if None in handlers else REQUIRED)
        if value not in handlers:
            names = sorted(name for name in handlers if name is not None)
            raise gcmd.error("%s has no %s '%s': known are %s"
                             % (cmd, key, value, ", ".join(names) or "none"))
        handlers[value](gcmd)

    def set_move_sink(self, sink):
        """Send plain G0/G1 lines to sink (MoveSink) from now on.

        Call it after registering G0 and G1: the sink is passed over while
        either has another handler than now.
        """
        self.runner.set_sink(sink, self.ready_gcode_handlers.get("G0"),
                             self.ready_gcode_handlers.get("G1"))

    def get_command_help(self):
        """Help texts by command."""
        return dict(self.gcode_help)

    def register_output_handler(self, callback):
        """Have callback(text) called with every response."""
        self.output_callbacks.append(callback)

    def get_mutex(self):
        """The mutex that whoever runs commands holds."""
        return self.mutex

    # State

    def get_status(self, eventtime):
        """commands: those that may be used now, with their help."""
        if self.status_commands is None:
            helps = self.gcode_help
            self.status_commands = {
                cmd: {"help": helps[cmd]} if cmd in helps else {}
                for cmd in self.gcode_handlers}
        return {"commands": self.status_commands}

    def _set_ready(self, is_ready):
        self.is_printer_ready = is_ready
        self.gcode_handlers = (self.ready_gcode_handlers if is_ready
                               else self.base_gcode_handlers)
        self.status_commands = None

    def _handle_ready(self):
        self._set_ready(True)
        self.respond_info("Klipper state: Ready", log=False)

    def _handle_shutdown(self):
        if self.is_printer_ready:
            self._set_ready(False)
            self.respond_info("Klipper state: Shutdown", log=False)

    def _handle_disconnect(self):
        self._set_ready(False)
        self.respond_info("Klipper state: Disconnect", log=False)

    # Running

    def run_script(self, script):
        """Run the lines of script, waiting for other scripts to end first.

        Errors are reported, then raised.
        """
        self.interrupts.note_arrival(script)
        self.mutex.lock_run(Run(find_label(script)))
        try:
            self.run_script_from_command(script)
        except PrinterError as err:
            self.report_error(err)
            raise
        finally:
            self.mutex.unlock()

    def run_script_from_command(self, script):
        """Run the lines of script within the command that runs now.

        Raises CommandInterrupted between two lines if somebody ends it.
        """
        run = self.mutex.find_own_run()
        for line in script.split("\n"):
            if run is not None and run.asked:
                run.check()
            self.runner.run_line(line, False)

    def run_terminal_line(self, line):
        """Run a line that waits for its ok; errors are reported, not raised.

        Returns False if the line failed.
        """
        self.mutex.lock_run(Run(find_label(line)))
        try:
            self.runner.run_line(line, True)
        except PrinterError as err:
            self.report_error(err)
            self.respond_raw("ok")
            return False
        finally:
            self.mutex.unlock()
        return True

    def run_parsed_line(self, line, need_ack):
        """Run a line by the full parser.  The caller holds the mutex."""
        line = self._strip_transport(line)
        match = _HEAD.match(line)
        if match is None:
            self._check_wordless(line)
            if need_ack:
                self.respond_raw("ok")
            return
        name, end = self._find_name(match)
        gcmd = GCodeCommand(self, name, line, None, need_ack, end)
        handler = self.gcode_handlers.get(name)
        if handler is None:
            handler = self.core_commands.run_unknown
        self._call(handler, gcmd)
        gcmd.ack()

    def _call(self, handler, gcmd):
        reactor = self.reactor
        start, switches = reactor.monotonic(), reactor.n_switches
        try:
            handler(gcmd)
        except PrinterError:
            raise
        except Exception as exc:
            raise self.make_internal_error(exc, gcmd.get_commandline())
        if reactor.n_switches == switches:
            busy = reactor.monotonic() - start
            if busy > SLOW_TIME:
                reactor.slow.note(busy, "G-code command " + gcmd.get_command())

    def _find_name(self, match):
        """Name of the command in upper case and where its text ends."""
        name = match.group(1).upper()
        if name in self.ready_gcode_handlers:
            return name, match.end(1)
        classic = _CLASSIC_HEAD.match(name)
        if classic is None or "_" in name:
            return name, match.end(1)
        name = "".join(classic.groups())
        return name, match.start(1) + classic.end()

    def _strip_transport(self, line):
        """The line without line number and checksum, which must be right."""
        numbered = _LINE_NUMBER.match(line)
        if "*" in line:
            found = _CHECKSUM.match(line)
            if found is not None:
                told, computed = int(found.group(2)), _checksum(found.group(1))
                if told == computed:
                    line = found.group(1)
                elif numbered:
                    raise self.error("The checksum of line '%s' is %d, it must be %d"
                                     % (shorten(line.strip()), told, computed))
        if numbered:
            line = line[numbered.end():]
        return line.strip(" \t\r\n\ufeff")

    def _check_wordless(self, line):
        """Pass over empty lines, comments and % marks."""
        if line and line[0] not in ";(%":
            raise self.error("'%s' is no G-code command" % (shorten(line),))

    def create_gcode_command(self, command, commandline, params):
        """A command with given parameters, to call a handler with."""
        return GCodeCommand(self, command, commandline, params)

    def make_internal_error(self, exc, line):
        """Log an unexpected exception; returns the CommandError for it."""
        logging.error("internal error in command '%s'", line, exc_info=exc)
        place = traceback.extract_tb(exc.__traceback__).pop()
        return self.error(
            "Internal error in command '%s': %s: %s (%s:%s)"
            % (shorten(line), type(exc).__name__, exc, os.path.basename(place.filename),
               place.lineno))

    # Responses

    def respond_raw(self, msg):
        """Send msg to all outputs as it is."""
        for callback in self.output_callbacks:
            callback(msg)

    def respond_info(self, msg, log=True):
        """Send msg as comment lines."""
        if log:
            logging.info(msg)
        lines = [line.strip() for line in msg.strip().split("\n")]
        self.respond_raw("// " + "\n// ".join(lines))

    def respond_error(self, msg):
        """Send msg as an error: its first line marked, details as comments."""
        logging.warning(msg)
        lines = msg.strip().split("\n")
        if len(lines) > 1:
            self.respond_info("\n".join(lines[1:]), log=False)
        self.respond_raw("!! %s" % (lines[0].strip(),))

    def report_error(self, err):
        """Tell everybody that a command failed, or was ended from outside."""
        if isinstance(err, CommandInterrupted):
            self.respond_info(str(err))
            return
        self.respond_error(str(err))
        self.printer.send_event("gcode:command_error")


def _checksum(text):
    total = 0
    for byte in text.encode("utf-8", "surrogatepass"):
        total ^= byte
    return total


def setup(printer):
    """Create the printer's GCodeDispatch and add it as object `gcode`."""
    gcode = GCodeDispatch(printer)
    printer.add_object("gcode", gcode)
    return gcode


def get(printer):
    """The printer's GCodeDispatch."""
    return printer.lookup_object("gcode")
