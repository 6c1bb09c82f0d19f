# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy console`: talk to one mcu in the words of its dictionary."""

import logging
import os
import re
import shlex
import sys

from klippy.cli import forget_stdout
from klippy.errors import PrinterError

HELP = "talk to one micro-controller directly"
TEXT = """\
Anything else is a command to the mcu, such as: get_uptime
In a value, {name} stands for what SET gave, {clock} and {freq} for the clock.
  DELAY <clock> <command>   send a command at a clock of the mcu
  FLOOD <count> <seconds> <command>   send a command again and again
  SET <name> <value>        give a name to a value
  SUPPRESS <message> [oid]  do not show a response any more
  STATS                     show figures of the link
  LIST                      list the commands and constants of the mcu
  HELP, QUIT
"""
NAME = re.compile(r"\{([^{}]*)\}")
LATE_ANSWERS = 0.5          # s for which answers are shown after the input's end


class Console:
    """Reads lines from a descriptor and shows what the mcu says."""

    def __init__(self, host_reactor, serial, sync, output):
        self.reactor, self.serial, self.sync = host_reactor, serial, sync
        self.output = output
        self.names = {}
        self.rest = b""
        self.is_lost = False
        self.suppressed = {("clock", None), ("stats", None)}
        self.actions = {
            "HELP": self._cmd_help, "LIST": self._cmd_list, "SET": self._cmd_set,
            "DELAY": self._cmd_delay, "FLOOD": self._cmd_flood,
            "STATS": self._cmd_stats, "SUPPRESS": self._cmd_suppress,
            "QUIT": self._cmd_quit}

    def start(self):
        """Show all that the mcu sends from now on."""
        self.serial.set_default_handler(self._show)
        self.sync.set_lost_callback(self._note_lost)
        version, build = self.serial.get_msgparser().get_version_info()
        self.write("Connected to %s (%s). HELP lists the commands." % (version, build))

    def write(self, text):
        """Show a line, from any thread; the session ends if nobody reads."""
        try:
            self.output.write(text + "\n")
            self.output.flush()
        except BrokenPipeError:
            forget_stdout()
            self.reactor.register_async_callback(
                lambda eventtime: self.reactor.end())

    def _show(self, params):
        name = params["#name"]
        if {(name, None), (name, params.get("oid"))} & self.suppressed:
            return
        self.write("%11.6f: %s" % (
            params["#receive_time"], self.serial.get_msgparser().format_params(params)))

    def _note_lost(self):
        """The mcu answers no longer: told once."""
        if not self.is_lost:
            self.write("The micro-controller answers no longer")
        self.is_lost = True

    def handle_input(self, data):
        """Take in typed bytes; b'' is the end of the input."""
        lines = (self.rest + data).split(b"\n")
        self.rest = lines.pop() if data else b""
        for line in lines:
            self.run_line(line.decode(errors="replace").strip())

    def run_line(self, line):
        """Carry out one line, showing errors."""
        if not line or line.startswith("#"):
            return
        try:
            words = shlex.split(self._fill_in(line))
            action = self.actions.get(words[0].upper())
            if action is not None:
                action(words[1:])
            else:
                self.serial.send(" ".join(words))
        except PrinterError as err:
            self.write("Error: %s" % (err,))
        except (ValueError, OverflowError, IndexError) as err:
            self.write("Error: '%s' cannot be used: %s (HELP lists the commands)"
                       % (line, err))

    def _fill_in(self, line):
        """The line with the values of the {name}s in it.  Raises ValueError."""
        clock = self.sync.get_clock(self.reactor.monotonic())
        values = {"clock": clock, "freq": int(self.sync.mcu_freq), **self.names}

        def get_value(match):
            name = match[1].strip()
            if name not in values:
                raise ValueError("there is no value '%s', only %s" % (
                    name, ", ".join(sorted(values))))
            return str(values[name])
        return NAME.sub(get_value, line)

    def _cmd_help(self, words):
        self.write(TEXT.rstrip())

    def _cmd_list(self, words):
        parser = self.serial.get_msgparser()
        for _, kind, text in parser.get_messages():
            self.write("%-8s %s" % (kind, text))
        for name, value in sorted(parser.get_constants().items()):
            self.write("constant %s = %s" % (name, value))

    def _cmd_set(self, words):
        name, value = take_words(words, "SET <name> <value>")
        self.names[name] = value

    def _cmd_delay(self, words):
        clock, *command = take_words(words, "DELAY <clock> <command>", True)
        self.serial.send(" ".join(command), minclock=int(float(clock)))

    def _cmd_flood(self, words):
        count, period, *_ = take_words(
            words, "FLOOD <count> <seconds> <command>", True)
        count, ticks = int(count), int(float(period) * self.sync.mcu_freq)
        first = self.sync.get_clock(self.reactor.monotonic()) + int(
            0.2 * self.sync.mcu_freq)
        for i in range(count):
            clock = first + i * ticks
            self.serial.send(" ".join(words[2:]), minclock=clock, reqclock=clock)

    def _cmd_stats(self, words):
        stats = self.serial.stats(self.reactor.monotonic())
        self.write(" ".join("%s=%s" % item for item in stats.items()))
        self.write(self.sync.dump_debug())

    def _cmd_suppress(self, words):
        if not words:
            raise ValueError("the form is SUPPRESS <message> [oid]")
        self.suppressed.add((words[0], int(words[1]) if len(words) > 1 else None))

    def _cmd_quit(self, words):
        self.reactor.end()


def take_words(words, form, is_open=False):
    """The words.  Raises ValueError if there are not as many as the form has.

    is_open: there may be more.
    """
    count = form.count("<")
    if len(words) < count or (len(words) > count and not is_open):
        raise ValueError("the form is %s" % (form,))
    return words


def add_arguments(parser):
    """Options of `klippy console`."""
    parser.add_argument(
        "device", help="serial port, pseudo terminal, tcp://host:port, unix://path, or"
        " sim[:FILE] for the simulator firmware")
    parser.add_argument("-b", "--baud", type=int, default=250000)
    parser.add_argument("-v", "--verbose", action="store_true", help="show the log")


def make_clock(is_simulated):
    """The clock of the session."""
    if is_simulated:
        from klippy_ext.vworld import VirtualWorld
        return VirtualWorld(seed=0)
    from klippy_ext.hostclock import RealClock
    return RealClock()


def connect(serial, args, clock):
    """Connect a SerialReader as the arguments ask for."""
    from klippy import seriallink
    device = args.device
    if device.partition(":")[0] == "sim":
        from klippy.simulator import firmware
        library = firmware.find_firmware(device.partition(":")[2] or None)
        mcu = clock.add_mcu("mcu", str(library), freq=0)
        serial.connect_virtual(clock, mcu)
    elif os.path.isfile(device) or os.path.isdir(device):
        raise PrinterError("'%s' is no serial device but a %s" % (
            device, "folder" if os.path.isdir(device) else "file"))
    elif seriallink.is_socket(device):
        serial.connect_remote(device)
    elif seriallink.is_terminal(device):
        serial.connect_pipe(device)
    else:
        serial.connect_uart(device, args.baud)


def run(args):
    """Run the command; returns the exit status."""
    from klippy import clocksync, reactor, serialhdl
    # of warnings too: a connection that is tried again is told of that way
    logging.basicConfig(level=logging.INFO if args.verbose else logging.WARNING,
                        format="%(message)s")
    is_sim = args.device.partition(":")[0] == "sim"
    clock = make_clock(is_sim)
    host_reactor = reactor.Reactor(clock)
    if is_sim:
        host_reactor.set_pace(1.)
    serial = serialhdl.SerialReader(host_reactor)
    sync = clocksync.ClockSync(host_reactor)
    console = Console(host_reactor, serial, sync, sys.stdout)
    failures = []

    def start(eventtime):
        try:
            connect(serial, args, clock)
            sync.connect(serial)
            console.start()
            watch_input(host_reactor, console)
        except PrinterError as err:
            failures.append(err)
            host_reactor.end()

    host_reactor.register_callback(start)
    try:
        host_reactor.run()
    except KeyboardInterrupt:
        console.write("")
    sync.disconnect()
    serial.disconnect()
    host_reactor.finalize()
    for err in failures:
        sys.stderr.write("klippy console: %s\n" % (err,))
    return 1 if failures else 0


def watch_input(host_reactor, console):
    """Hand typed bytes to the console; at their end, wait for late answers."""
    fd = sys.stdin.fileno()

    def read(eventtime):
        data = os.read(fd, 4096)
        if data:
            console.handle_input(data)
            return
        host_reactor.unregister_fd(handler)
        console.handle_input(b"")
        host_reactor.pause(host_reactor.monotonic() + LATE_ANSWERS)
        host_reactor.end()

    handler = host_reactor.register_fd(fd, read)
