# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy run`: the daemon that drives a printer, or a batch run.

With -o the commands for the mcus go to files, in virtual time.  With --simulate
the mcus and the machine are simulated ones, in real time.
"""

import atexit
import gc
import importlib
import logging
import os
import signal
import sys

import klippy.extras
from klippy import api_socket, gcode_io, plugins, queuelogger, sdnotify, sysinfo
from klippy.errors import PrinterError
from klippy.printer import Printer
from klippy.reactor import Reactor
from klippy_ext import realtime
from klippy_ext.hostclock import RealClock
from klippy_ext.vworld import VirtualWorld

HELP = "the daemon that drives a printer; with -i and -o a batch run"
DEFAULT_TTY = "/tmp/printer"
RESTART_PAUSE = 1.          # s between two printers


def add_arguments(parser):
    """Declare the historical command line."""
    parser.add_argument("config", nargs="?", help="printer.cfg")
    parser.add_argument("-i", "--debuginput", metavar="GCODE",
                        help="read commands from a file, not from the tty")
    parser.add_argument("-o", "--debugoutput", metavar="OUT",
                        help="write the mcu's commands to a file")
    parser.add_argument("-d", "--dictionary", metavar="[MCU=]DICT",
                        action="append", default=[],
                        help="dictionary for -o (klipper.dict)")
    parser.add_argument("-l", "--logfile", metavar="LOG",
                        help="write the log to a file")
    parser.add_argument("-a", "--api-server", metavar="API_SOCKET",
                        help="serve the API at a Unix socket")
    parser.add_argument("--api-server-file-mode", metavar="OCTAL", type=parse_mode,
                        help="access rights of the API socket, as 660")
    parser.add_argument("--api-server-user", metavar="USER", type=parse_user,
                        help="owner of the API socket, by name or number")
    parser.add_argument("--api-server-group", metavar="GROUP", type=parse_group,
                        help="group of the API socket, by name or number")
    parser.add_argument("-I", "--input-tty", metavar="TTY", default=DEFAULT_TTY,
                        help="where to make the G-code tty (%(default)s)")
    parser.add_argument("-v", dest="verbose", action="store_true",
                        help="log debug messages")
    parser.add_argument("-n", "--no-tty", action="store_true",
                        help="make no G-code tty")
    parser.add_argument("--rotate-log-at-restart", action="store_true",
                        help="begin a new log file at each start")
    parser.add_argument("--plugins", metavar="FOLDER", action="append", default=[],
                        help="folder whose files win over the built-in extras")
    parser.add_argument("--simulate", action="store_true",
                        help="drive the simulated machine of the config")
    parser.add_argument("--speed", type=float, default=1., metavar="N",
                        help="with --simulate: virtual seconds a real one, 0: as"
                             " fast as it goes (%(default)g)")
    parser.add_argument("--import-test", action="store_true",
                        help="import all modules and exit")


def parse_mode(text):
    """Access rights (int) from octal digits.  Raises ValueError."""
    mode = int(text, 8)
    if not 0 <= mode <= 0o777:
        raise ValueError(text)
    return mode


def parse_user(text):
    """Number of a user from that or a name.  Raises ValueError."""
    import pwd
    try:
        return int(text) if text.isdecimal() else pwd.getpwnam(text).pw_uid
    except KeyError:
        raise ValueError(text) from None


def parse_group(text):
    """Number of a group from that or a name.  Raises ValueError."""
    import grp
    try:
        return int(text) if text.isdecimal() else grp.getgrnam(text).gr_gid
    except KeyError:
        raise ValueError(text) from None


def run(options):
    """Carry out a parsed command line; returns the exit status."""
    plugins.install()
    if options.import_test:
        return test_imports()
    if not options.config:
        return complain("name the printer.cfg (see klippy run --help)")
    return Daemon(options).run()


def complain(text):
    """Print why the command cannot start; returns its exit status."""
    print("klippy run: %s" % (text,), file=sys.stderr)
    return 2


def test_imports():
    """Import every module of the package; returns the exit status."""
    import pkgutil
    failed = 0
    for package in ("klippy.extras", "klippy.kinematics", "klippy"):
        folders = importlib.import_module(package).__path__
        for info in pkgutil.iter_modules(folders, package + "."):
            if info.name == "klippy.__main__":
                continue
            try:
                importlib.import_module(info.name)
            except (ImportError, SyntaxError) as err:
                print("importing %s failed: %s" % (info.name, err), file=sys.stderr)
                failed += 1
    return 1 if failed else 0


def parse_dictionaries(texts):
    """{mcu name: path} of `-d [MCU=]DICT` arguments; the main mcu is None."""
    dictionaries = {}
    for text in texts:
        name, is_named, path = text.rpartition("=")
        dictionaries[name.strip() if is_named else None] = path.strip()
    return dictionaries


class Daemon:
    """Starts printers one after the other until one says to exit."""

    def __init__(self, options):
        self.options = options
        self.is_batch = bool(options.debugoutput)
        self.start_args = {}
        self.bglogger = None
        self.notifier = sdnotify.Notifier()
        self.terminal = None        # (path, target) of the tty's link

    def run(self):
        """Run until the end; returns the exit status."""
        options = self.options
        gc.freeze()
        atexit.register(gc.freeze)      # nothing is collected for the end's sake
        if options.debuginput and not os.access(options.debuginput, os.R_OK):
            return complain("unable to read the G-code file '%s'"
                            % (options.debuginput,))
        try:
            self._open_log()
            for folder in options.plugins:
                plugins.add_folder(klippy.extras, folder)
            self._make_start_args()
            return self._run_printers()
        except (OSError, PrinterError) as err:
            if self.bglogger is not None:
                logging.error("the daemon cannot run: %s", err)
            return complain(str(err))
        finally:
            self.notifier.send(STOPPING=1)
            self.notifier.close()
            if self.terminal is not None:
                gcode_io.remove_terminal(*self.terminal)
            if self.bglogger is not None:
                self.bglogger.stop()

    def _open_log(self):
        level = logging.DEBUG if self.options.verbose else logging.INFO
        if self.options.logfile:
            path = self.options.logfile
            try:
                self.bglogger = queuelogger.setup_bg_logging(path, level)
            except OSError as err:
                raise PrinterError("Unable to write the log file '%s': %s"
                                   % (path, err.strerror))
        else:
            logging.basicConfig(level=level, format="%(message)s")

    def _make_start_args(self):
        options, args = self.options, self.start_args
        args["config_file"] = options.config
        args["apiserver"] = options.api_server
        for kind in ("file_mode", "user", "group"):
            value = getattr(options, "api_server_" + kind, None)
            if value is not None:
                args["apiserver_" + kind] = value
        args["start_reason"] = "startup"
        args["log_file"] = options.logfile
        args["software_version"] = sysinfo.get_version()
        args["cpu_info"] = sysinfo.get_cpu_info()
        if options.debuginput:
            args["debuginput"] = options.debuginput
        elif not options.no_tty and not self.is_batch:
            self._make_terminal(options.input_tty)
        if self.is_batch:
            args["debugoutput"] = options.debugoutput
            args["dictionary"] = parse_dictionaries(options.dictionary)

    def _make_terminal(self, path):
        """Make the G-code tty; not that of a daemon that runs already."""
        socket_path = self.options.api_server
        try:
            if socket_path:
                api_socket.make_free(socket_path)
        except OSError as err:
            raise PrinterError(api_socket.describe_error(socket_path, err))
        try:
            self.start_args["gcode_fd"] = gcode_io.create_terminal(path)
        except OSError as err:
            raise PrinterError("Unable to make the G-code tty '%s': %s; -I names"
                               " another, -n makes none" % (path, err.strerror))
        self.start_args["gcode_in"] = path
        self.terminal = path, os.readlink(path)

    def _make_clock(self):
        if self.options.simulate:
            return self._make_machine().world
        return VirtualWorld() if self.is_batch else RealClock()

    def _make_machine(self):
        """The simulated machine, wired by what the config says now."""
        from klippy.simulator import machine, session
        sections = session.load_sections(self.options.config)
        seed = machine.read_seed(sections)
        self.start_args["machine"] = machine.SimMachine(
            VirtualWorld(seed=seed), sections, seed)
        return self.start_args["machine"]

    def _run_printers(self):
        self._log_versions()
        clock = self._make_clock()
        if isinstance(clock, RealClock) and not self.is_batch:
            hold_memory()
        while True:
            reactor = Reactor(clock)
            if self.options.simulate:
                reactor.set_pace(self.options.speed)
            elif self.is_batch and not self.options.debuginput:
                reactor.set_pace(1.)
            result = self._run_printer(reactor)
            if result in ("exit", "error_exit"):
                return 1 if result == "error_exit" else 0
            reactor.pause(reactor.monotonic() + RESTART_PAUSE)
            reactor.finalize()
            gc.collect()
            logging.info("restarting the printer")
            self.start_args["start_reason"] = result

    def _run_printer(self, reactor):
        if self.bglogger is not None:
            self.bglogger.clear_rollover_info()
            self.bglogger.set_rollover_info("versions", self._get_versions())
            if self.options.rotate_log_at_restart:
                self.bglogger.roll_over()
        printer = Printer(reactor, self.bglogger, self.start_args)
        printer.register_event_handler("klippy:ready", freeze_objects)
        handlers = self._catch_signals(printer)
        self.notifier.watch(printer)
        try:
            result = printer.run()
        finally:
            gc.unfreeze()
            for number, handler in handlers:
                signal.signal(number, handler)
        if result in ("exit", "error_exit"):
            reactor.finalize()
        return result

    @staticmethod
    def _catch_signals(printer):
        """Have SIGTERM and SIGINT end the printer; returns the old handlers."""
        def handle(number, frame):
            printer.get_reactor().register_async_callback(
                lambda eventtime: printer.request_exit("exit"))
        return [(number, signal.signal(number, handle))
                for number in (signal.SIGTERM, signal.SIGINT)]

    def _get_versions(self):
        return "\n".join((
            "Args: %s" % (sys.argv,), "Version: %s" % (
                self.start_args["software_version"],),
            "CPU: %s" % (self.start_args["cpu_info"],),
            "Python: %r" % (sys.version,)))

    def _log_versions(self):
        logging.info("%s", self._get_versions())
        for source in sysinfo.find_stale_modules():
            logging.warning("'%s' is newer than its compiled form, which is used:"
                            " build again", source)


def hold_memory():
    """Keep the system from swapping the host out, where that is permitted."""
    try:
        realtime.lock_memory()
        logging.info("memory is locked: the host is not swapped out")
    except OSError as err:
        logging.info("memory is not locked (%s): the host may be swapped out"
                     " when memory is short", err.strerror)


def freeze_objects():
    """Keep the garbage collector from walking all that was loaded.

    Next to nothing of that is garbage, so it is not looked for first.
    """
    gc.freeze()
