# SPDX-License-Identifier: GPL-3.0-or-later
"""A printer on the bench: just enough of one to hold a single extra.

Pins record what is sent to them, time is set by the test.
"""
from klippy.errors import CommandError, ConfigError
from klippy.gcode_run import Interrupts
from klippy.simulator import settings


class Section(settings.Section):
    """A config section over a dict of options, with its printer."""

    def __init__(self, printer, name, options):
        super().__init__(name, {k: str(v) for k, v in options.items()})
        self.printer = printer

    def get_printer(self):
        return self.printer

    def get(self, option, default=settings.REQUIRED, **note):
        if option not in self.options and default is settings.REQUIRED:
            raise ConfigError("Option '%s' in section '%s' must be specified"
                              % (option, self.name))
        return self.options.get(option, default)

    def getfloat(self, option, default=settings.REQUIRED, minval=None,
                 maxval=None, above=None, below=None):
        value = super().getfloat(option, default)
        if value is not None and option in self.options and (
                (minval is not None and value < minval)
                or (maxval is not None and value > maxval)
                or (above is not None and value <= above)):
            raise ConfigError("Option '%s' out of range" % option)
        return value

    def getchoice(self, option, choices, default=settings.REQUIRED):
        return choices[self.get(option, default)]

    def getlist(self, option, default=settings.REQUIRED):
        value = self.get(option, default)
        if isinstance(value, str):
            return tuple(part.strip() for part in value.split(","))
        return value

    def has_section(self, name):
        return name in self.printer.sections

    def getsection(self, name):
        return self.printer.make_section(name)


class Mcu:
    name = "mcu"

    def __init__(self, printer):
        self.printer = printer

    def get_name(self):
        return self.name

    def estimated_print_time(self, eventtime):
        return eventtime

    def min_schedule_time(self):
        return 0.1

    def max_nominal_duration(self):
        return 3.0


class Pin:
    """Any output or analog pin; `sent` lists (print_time, value)."""

    def __init__(self, mcu, kind, name):
        self.mcu, self.kind, self.name = mcu, kind, name
        self.sent, self.setup = [], {}
        self.samples = (0.0, 0.0)

    def get_mcu(self):
        return self.mcu

    def __getattr__(self, name):
        if not name.startswith("setup_"):
            raise AttributeError(name)

        def note(*args, **kwargs):
            self.setup[name] = (args, kwargs)
        return note

    def set_pwm(self, print_time, value):
        self.sent.append((round(print_time, 6), value))

    set_digital = set_pwm

    def get_last_value(self):
        return self.samples

    def report(self, time, fraction):
        self.samples = (fraction, time)
        self.setup["setup_adc_callback"][0][0]([(time, fraction)])


class Clarifier:
    def __init__(self):
        self.clarifiers = []

    def add_clarify(self, reason, callback):
        self.clarifiers.append((reason, callback))


class GCodeCommand:
    error = CommandError

    def __init__(self, printer, params):
        self.printer = printer
        self.params = {k: str(v) for k, v in params.items()}

    def get(self, name, default=settings.REQUIRED):
        if name not in self.params and default is settings.REQUIRED:
            raise CommandError("missing %s" % name)
        return self.params.get(name, default)

    def get_float(self, name, default=settings.REQUIRED, minval=None,
                  maxval=None, above=None):
        text = self.get(name, default)
        value = float(text) if isinstance(text, str) else text
        if value is not None and (
                (minval is not None and value < minval)
                or (maxval is not None and value > maxval)
                or (above is not None and value <= above)):
            raise CommandError("%s out of range" % name)
        return value

    def get_int(self, name, default=settings.REQUIRED):
        return int(self.get(name, default))

    def ack(self, message=None):
        return False

    def respond_raw(self, message):
        self.printer.output.append(message)

    respond_info = respond_raw


class Completion:
    """Waits by letting the bench's time pass."""

    def __init__(self, printer):
        self.printer, self.is_done = printer, False

    def complete(self, result):
        self.is_done = True

    def wait(self, waketime):
        if not self.is_done:
            self.printer.pause(waketime)


class Mutex:
    """The commands of the bench run by themselves."""

    def test(self):
        return False

    def find_own_run(self):
        return None


class Printer:
    """Printer, reactor, gcode, pins, toolhead and motion queue in one."""

    command_error = CommandError
    config_error = ConfigError
    NOW, NEVER = 0.0, 1e15

    def __init__(self, sections=None):
        self.sections = sections or {}
        self.objects = {n: self for n in (
            "gcode", "pins", "toolhead", "motion_queuing", "configfile")}
        self.objects["error_mcu"] = Clarifier()
        self.mcu = Mcu(self)
        self.start_args = {}
        self.handlers, self.commands, self.muxes = {}, {}, {}
        self.pins, self.output, self.timers = {}, [], []
        self.flush_callbacks, self.saved = [], []
        self.now = 100.0
        self.print_time = 200.0
        self.shutdown_message = None
        self.on_pause = lambda now: None
        self.interrupts = Interrupts(self, Mutex())

    # printer
    def get_reactor(self):
        return self

    def get_start_args(self):
        return self.start_args

    def is_shutdown(self):
        return self.shutdown_message is not None

    def invoke_shutdown(self, message):
        self.shutdown_message = message

    def lookup_object(self, name, default=settings.REQUIRED):
        if default is settings.REQUIRED:
            return self.objects[name]
        return self.objects.get(name, default)

    def make_section(self, name):
        return Section(self, name, self.sections.get(name, {}))

    def load_object(self, config, name):
        if name not in self.objects:
            import importlib
            module = importlib.import_module(
                "klippy.extras." + name.split()[0])
            is_prefix = len(name.split()) > 1
            load = module.load_config_prefix if is_prefix else module.load_config
            self.objects[name] = None
            self.objects[name] = load(self.make_section(name))
        return self.objects[name]

    def register_event_handler(self, event, handler):
        self.handlers.setdefault(event, []).append(handler)

    def send(self, event, *args):
        for handler in self.handlers.get(event, []):
            handler(*args)

    def start(self):
        self.send("klippy:connect")
        self.send("klippy:ready")

    # reactor
    def monotonic(self):
        return self.now

    def register_timer(self, callback, waketime=NEVER):
        timer = [waketime, callback]
        self.timers.append(timer)
        return timer

    def update_timer(self, timer, waketime):
        timer[0] = waketime

    def register_async_callback(self, callback, waketime=0.0):
        callback(self.now)

    def completion(self):
        return Completion(self)

    def pause(self, waketime):
        self.now = waketime
        self.on_pause(waketime)
        return self.now

    def advance(self, seconds):
        """Let timers run for a while."""
        end = self.now + seconds
        while self.timers and min(t[0] for t in self.timers) <= end:
            timer = min(self.timers, key=lambda t: t[0])
            self.now = max(self.now, timer[0])
            timer[0] = timer[1](self.now)
        self.now = end

    # pins
    def setup_pin(self, kind, name):
        pin = self.pins[name] = Pin(self.mcu, kind, name)
        return pin

    # gcode
    def register_command(self, name, func, when_not_ready=False, desc=None,
                         yields=False):
        self.commands[name] = func

    def register_mux_command(self, name, key, value, func, desc=None,
                             yields=False):
        self.muxes[name, value] = func

    def run(self, name, mux=None, **params):
        func = self.commands[name] if mux is None else self.muxes[name, mux]
        func(GCodeCommand(self, params))

    def respond_raw(self, message):
        self.output.append(message)

    def respond_info(self, message):
        self.output.append("// " + message)

    # configfile
    def set(self, section, option, value):
        self.saved.append((section, option, value))

    # toolhead and motion queue
    def get_last_move_time(self):
        return self.print_time

    def register_lookahead_callback(self, callback):
        callback(self.print_time)

    def register_flush_callback(self, callback):
        self.flush_callbacks.append(callback)

    def note_mcu_movequeue_activity(self, print_time):
        pass

    def flush(self, flush_time):
        for callback in self.flush_callbacks:
            callback(flush_time, flush_time)
