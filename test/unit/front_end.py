# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer without motion for tests: real reactor, G-code and API objects.

Time is virtual and passes only while everybody waits.
"""

import importlib
import pathlib

from klippy import errors, gcode, reactor, waiter

waiter.POLL_INTERVAL = 0.       # the wall clock decides nothing

MISSING = object()


class Clock:
    """The least a virtual world does."""

    def __init__(self):
        self.now = 100.

    def monotonic(self):
        return self.now

    def advance(self, limit):
        self.now = max(self.now, limit)
        return self.now

    def take_ready(self):
        return ()


class Section:
    """One config section out of a dict of texts."""
    error = errors.ConfigError

    def __init__(self, printer, name, options):
        self.printer, self.name, self.options = printer, name, options
        self.read = set()

    def get_printer(self):
        return self.printer

    def get_name(self):
        return self.name

    def get(self, option, default=MISSING, note_valid=True, parser=str):
        self.read.add(option)
        if option in self.options:
            return parser(self.options[option])
        if default is MISSING:
            raise self.error("Option '%s' in section '%s' must be specified"
                             % (option, self.name))
        return default

    def getfloat(self, option, default=MISSING, minval=None, above=None, **limits):
        return self.get(option, default, parser=float)

    def getint(self, option, default=MISSING, **limits):
        return self.get(option, default, parser=int)

    def getboolean(self, option, default=MISSING):
        return self.get(option, default, parser=lambda text: text == "True")

    def getchoice(self, option, choices, default=MISSING):
        return choices[self.get(option, default)]

    def get_prefix_options(self, prefix):
        return [name for name in self.options if name.startswith(prefix)]


class GCodeMove:
    """Position and transforms of the real one, without units and origins."""

    def __init__(self, printer):
        self.position, self.extrude_factor = [0.] * 4, 1.
        self.transform, self.moves = self, []
        self.toolhead_position = [0.] * 4
        registry = printer.lookup_object("gcode")
        for name in ("G0", "G1"):
            registry.register_command(name, self.cmd_G1)
        for name in ("SAVE_GCODE_STATE", "RESTORE_GCODE_STATE"):
            registry.register_command(name, self.note_state)
        self.states = []

    def get_status(self, eventtime):
        return {"position": list(self.position),
                "extrude_factor": self.extrude_factor}

    def set_move_transform(self, transform, force=False):
        old, self.transform = self.transform, transform
        return old

    def reset_last_position(self):
        self.position = list(self.transform.get_position())

    def get_position(self):
        return list(self.toolhead_position)

    def move(self, position, speed):
        self.toolhead_position = list(position)
        self.moves.append(list(position))

    def cmd_G1(self, gcmd):
        for index, letter in enumerate("XYZE"):
            value = gcmd.get_float(letter, None)
            if value is not None:
                self.position[index] = value
        self.transform.move(list(self.position), 50.)

    def note_state(self, gcmd):
        self.states.append(gcmd.get_commandline())


class Extruder:
    def get_name(self):
        return "extruder"


class Toolhead:
    """Says for how long it still moves."""

    def __init__(self):
        self.end_time, self.is_empty = 0., True

    def check_busy(self, eventtime):
        return self.end_time, eventtime, self.is_empty

    def get_last_move_time(self):
        return self.end_time

    def get_extruder(self):
        return Extruder()


class Printer:
    """Objects, events and states, as far as the front end needs them."""
    config_error = errors.ConfigError
    command_error = errors.CommandError

    def __init__(self, **start_args):
        self.start_args, self.objects, self.handlers = start_args, {}, {}
        self.state, self.message = "startup", "Printer is not ready"
        self.exit_result, self.events = None, []
        self.clock = Clock()
        self.reactor = reactor.Reactor(self.clock)
        self.gcode = gcode.setup(self)
        self.output = []
        self.gcode.register_output_handler(self.output.append)

    def get_reactor(self):
        return self.reactor

    def get_start_args(self):
        return self.start_args

    def get_state_message(self):
        return self.message, self.state

    def is_shutdown(self):
        return self.state == "shutdown"

    def invoke_shutdown(self, message):
        self.state, self.message = "shutdown", message
        self.send_event("klippy:shutdown")

    def request_exit(self, result):
        self.exit_result = result
        self.reactor.end()

    def add_object(self, name, obj):
        assert name not in self.objects
        self.objects[name] = obj

    def lookup_object(self, name, default=MISSING):
        if name not in self.objects and default is MISSING:
            raise self.config_error("Unknown config object '%s'" % (name,))
        return self.objects.get(name, default)

    def lookup_objects(self, module=None):
        return list(self.objects.items())

    def load_object(self, config, name, default=MISSING):
        if name not in self.objects:
            self.load(name)
        return self.objects[name]

    def load(self, section, **options):
        """Load an extra with its options; returns its object."""
        module = importlib.import_module("klippy.extras." + section.split()[0])
        kind = "load_config_prefix" if " " in section else "load_config"
        obj = getattr(module, kind)(Section(self, section, options))
        self.objects[section] = obj
        return obj

    def register_event_handler(self, event, callback):
        self.handlers.setdefault(event, []).append(callback)

    def send_event(self, event, *args):
        self.events.append((event,) + args)
        return [callback(*args) for callback in list(self.handlers.get(event, ()))]

    def make_ready(self):
        self.send_event("klippy:connect")
        self.state, self.message = "ready", "Printer is ready"
        self.send_event("klippy:ready")
        self.output.clear()

    def run_for(self, seconds):
        """Let virtual time pass, with some looks at the descriptors."""
        for _ in range(5):
            self.reactor.pause(self.clock.now + seconds / 5)

    def close(self):
        self.send_event("klippy:disconnect")
        self.reactor.finalize()


def make_printer(*sections, motion=False, **start_args):
    """A ready printer with extras loaded by name or (name, options)."""
    printer = Printer(**start_args)
    if motion:
        printer.add_object("gcode_move", GCodeMove(printer))
        printer.add_object("toolhead", Toolhead())
    for section in sections:
        name, options = section if isinstance(section, tuple) else (section, {})
        printer.load(name, **options)
    printer.make_ready()
    return printer


def write_file(folder, name, data):
    """Write a G-code file (str or bytes); returns its path."""
    path = pathlib.Path(folder) / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path
