# SPDX-License-Identifier: GPL-3.0-or-later
"""The printer: its objects, its state, its start, stop and restart.

A printer that cannot start stays up with a message, so that the config can be
corrected and RESTART be used.
"""

import collections
import gc
import importlib
import logging
import os

import klippy.extras
from klippy import (
    configfile,
    dangers,
    gcode,
    gcode_io,
    mcu,
    pins,
    plugins,
    toolhead,
    webhooks,
)
from klippy.errors import (
    CommandError,
    ConfigError,
    ConfigErrors,
    McuError,
    PrinterError,
)
from klippy.kinematics import extruder

__all__ = ["Printer"]

MESSAGE_READY = "Printer is ready"
MESSAGE_STARTUP = """\
The printer is starting: it connects to its micro-controllers.
Try again in a moment.
"""
HINT_CONFIG = """
Correct the config file, then use the RESTART command.
The printer is halted.
"""
HINT_MCU = """
Check the micro-controller and its connection, then use the
FIRMWARE_RESTART command to reset it and start again.
The printer is halted.
"""
HINT_SHUTDOWN = """
When the cause is dealt with, use the FIRMWARE_RESTART command to
reset the micro-controllers and start again.
The printer is shut down.
"""
HINT_INTERNAL = """
This is a defect of the software: the log file tells more.
Use the RESTART command to start again.
"""
# Their add_printer_objects(config) run before the sections of the config are
# loaded, and after that
FIRST_MODULES = (pins, mcu)
LAST_MODULES = (toolhead, extruder)


class _Required:
    """Default of a lookup that must succeed."""


# may_lack: it can do without what the firmware of an mcu lacks
LoadedSection = collections.namedtuple("LoadedSection", ("name", "may_lack"))


class SectionLoader:
    """Loads the sections of a config into printer objects, noting all errors."""

    def __init__(self, printer):
        self.printer = printer
        self.errors = []
        self.failed = {}                # section -> its ConfigError
        self.misnamed = {}              # section without entry point -> text
        # What is being made, innermost last; None for a core module
        self.loading = []

    def try_call(self, func, *args):
        """Call func; a ConfigError is noted.  Returns True without error."""
        try:
            func(*args)
        except ConfigError as err:
            if not any(err is known for known in self.errors):
                self.errors.append(err)
            return False
        return True

    def load(self, config, section, default=_Required):
        """The object of a section; see Printer.load_object()."""
        if section in self.failed:
            raise self.failed[section]
        try:
            module, entry = self._find_entry(section, default)
            if entry is None:
                return default
            obj = self._make(module, entry, config.getsection(section))
        except ConfigError as err:
            config.fileconfig.locate(err, section)
            self.failed[section] = err
            raise
        self.printer.objects[section] = obj
        return obj

    def _make(self, module, entry, config):
        may_lack = getattr(module, "MAY_LACK_FIRMWARE", False)
        self.loading.append(LoadedSection(config.get_name(), may_lack))
        try:
            return entry(config)
        finally:
            self.loading.pop()

    def find_loading(self):
        """The LoadedSection that is being made; None if there is none."""
        if not self.loading:
            return None
        if self.loading[-1] is not None:
            return self.loading[-1]
        # a core module asks many sections
        store = self.printer.lookup_object("configfile").store
        return LoadedSection(store.last_asked[0], False)

    def _find_entry(self, section, default):
        """The module of a section and its function that makes the object."""
        module = self._find_module(section.partition(" ")[0], default)
        if module is None:
            return None, None
        is_named = " " in section
        entry = getattr(module, "load_config_prefix" if is_named else "load_config",
                        None)
        if entry is None:
            self.misnamed[section] = "section [%s] must have %s" % (
                section, "no name" if is_named else "a name: [%s my_name]" % (section,))
            if default is _Required:
                raise ConfigError(self.misnamed[section])
        return module, entry

    def _find_module(self, name, default):
        if not name.isidentifier():
            return self._unknown(name, default)
        full_name = "klippy.extras." + name
        try:
            module = importlib.import_module(full_name)
        except ModuleNotFoundError as err:
            if err.name == full_name:
                return self._unknown(name, default)
            raise ConfigError("the module of section [%s] cannot be imported: it needs"
                              " the Python module '%s'" % (name, err.name))
        except (ImportError, SyntaxError) as err:
            logging.exception("importing '%s' failed", full_name)
            raise ConfigError("the module of section [%s] cannot be imported: %s"
                              % (name, err))
        plugins.log_shadowing(module, klippy.extras.BUILTIN_PATHS)
        return module

    @staticmethod
    def _unknown(name, default):
        if default is _Required:
            raise ConfigError("there is no module '%s'" % (name,))

    def load_all(self, config):
        """Load everything.  Raises ConfigError, with all that is wrong."""
        is_begun = True
        for module in FIRST_MODULES:
            is_begun &= self.try_call(self._add_core, module, config)
        if is_begun:
            for section in config.get_prefix_sections(""):
                self.try_call(self._load_optional, config, section.get_name())
            for module in LAST_MODULES:
                if not self.try_call(self._add_core, module, config):
                    break       # the next one needs it
        self._check_unused(config, is_begun)
        if self.errors:
            raise configfile.collect(self.errors)

    def _add_core(self, module, config):
        self.loading.append(None)
        try:
            module.add_printer_objects(config)
        except ConfigError as err:
            if not isinstance(err, ConfigErrors):
                store = config.fileconfig
                store.locate(err, err.section or store.last_asked[0])
            raise
        finally:
            self.loading.pop()

    def _load_optional(self, config, section):
        if section not in self.printer.objects:
            self.load(config, section, None)

    def _check_unused(self, config, is_begun):
        kinds = list_section_kinds()
        skipped = set(self.failed)
        for name in config.fileconfig.sections():
            # whatever reads the sections without module may not have run
            is_unread = (self._is_core_section(name) if is_begun
                         else name.partition(" ")[0] in kinds)
            if self.errors and is_unread and name not in self.printer.objects:
                skipped.add(name)
        self.try_call(self.printer.lookup_object("configfile").check_unused_options,
                      config, skipped, kinds, self.misnamed)

    @staticmethod
    def _is_core_section(name):
        kind = name.partition(" ")[0]
        return kind in ("printer", "mcu") or kind.startswith(("stepper", "extruder"))


def list_section_kinds():
    """Names of the sections that modules are there for."""
    names = {entry.name.partition(".")[0] for folder in klippy.extras.__path__
             if os.path.isdir(folder) for entry in os.scandir(folder)
             if entry.name.endswith((".py", ".so")) or entry.is_dir()}
    return sorted([*names, "printer", "mcu", "extruder", "stepper_x", "stepper_y",
                   "stepper_z", "stepper_a", "stepper_b", "stepper_c"])


class Printer:
    """Registry of a printer's objects and owner of its state.

    reactor: Reactor.  bglogger: QueueListener or None.  start_args: dict, see
    docs/internals/printer.md.
    """
    config_error = ConfigError
    command_error = CommandError

    def __init__(self, reactor, bglogger, start_args):
        self.reactor, self.bglogger = reactor, bglogger
        self.start_args = start_args
        self.objects = {}
        self.event_handlers = {}
        self.state, self.state_message = "startup", MESSAGE_STARTUP
        self.in_shutdown_state = False
        self.run_result = None
        self.load_errors = []
        self.loader = SectionLoader(self)
        reactor.set_error_handler(self._handle_internal_error)
        gcode.setup(self)
        webhooks.setup(self)
        gcode_io.setup(self)
        self.add_object("configfile", configfile.PrinterConfig(self))

    # Objects

    def get_start_args(self):
        """The start arguments (dict); not to be changed."""
        return self.start_args

    def get_reactor(self):
        """The Reactor."""
        return self.reactor

    def add_object(self, name, obj):
        """Register an object.  Raises ConfigError if the name is taken."""
        if name in self.objects:
            raise ConfigError("printer object '%s' exists already" % (name,))
        self.objects[name] = obj

    def lookup_object(self, name, default=_Required):
        """The object of a name.  Raises ConfigError without it and default."""
        if name in self.objects:
            return self.objects[name]
        if default is _Required:
            raise ConfigError("there is no printer object '%s'%s" % (
                name, configfile.propose(name, self.objects)))
        return default

    def lookup_objects(self, module=None):
        """Pairs of name and object: all, or those of one section kind."""
        if module is None:
            return list(self.objects.items())
        prefix = module + " "
        found = [(name, obj) for name, obj in self.objects.items()
                 if name.startswith(prefix)]
        if module in self.objects:
            return [(module, self.objects[module]), *found]
        return found

    def load_object(self, config, section, default=_Required):
        """The object of a section, which is made if need be.

        Raises ConfigError if there is no module for it, unless default is given.
        """
        if section in self.objects:
            return self.objects[section]
        return self.loader.load(config, section, default)

    def find_loading(self):
        """The section whose object is being made, (name, may_lack), or None."""
        return self.loader.find_loading()

    # Events

    def register_event_handler(self, event, callback):
        """Have callback called with the arguments of an event."""
        self.event_handlers.setdefault(event, []).append(callback)

    def send_event(self, event, *params):
        """Call the handlers of an event; returns what they return."""
        return [callback(*params)
                for callback in list(self.event_handlers.get(event, ()))]

    def _send_protected(self, event, *params):
        """Call all handlers, also if one of them fails."""
        for callback in list(self.event_handlers.get(event, ())):
            self.reactor.call_protected(callback, *params)

    # State

    def get_state_message(self):
        """(message, state): startup, ready, error or shutdown."""
        return self.state_message, self.state

    def is_shutdown(self):
        """True after a shutdown."""
        return self.in_shutdown_state

    def _set_state(self, state, message):
        if self.state != "shutdown":
            self.state, self.state_message = state, message
            if state != "ready" and self.start_args.get("debuginput") is not None:
                self.request_exit("error_exit")

    def update_error_msg(self, old_message, message):
        """Replace the message of an error or shutdown by a better one.

        Nothing happens if old_message is not what the state is about.
        """
        if (self.state in ("error", "shutdown")
                and self.state_message.startswith(old_message)):
            self.state_message = message

    def set_rollover_info(self, name, info, log=True):
        """Log info, and again at the start of each new log file."""
        if log and info is not None:
            logging.info(info)
        if self.bglogger is not None:
            self.bglogger.set_rollover_info(name, info)

    # Start

    def run(self):
        """Start and serve until an exit is asked for; returns how to go on.

        'exit', 'error_exit', 'restart' or 'firmware_restart'.
        """
        self.reactor.register_callback(self._connect)
        self.reactor.run()
        if self.run_result == "firmware_restart":
            self._send_protected("klippy:firmware_restart")
        self._send_protected("klippy:disconnect")
        return self.run_result

    def load(self):
        """Read the config and make all objects.  Raises ConfigError."""
        is_collecting = gc.isenabled()
        gc.disable()            # next to nothing that is made here is garbage
        try:
            self._load()
        finally:
            if is_collecting:
                gc.enable()

    def _load(self):
        pconfig = self.objects["configfile"]
        config = pconfig.read_main_config()
        if config.has_section(dangers.SECTION):
            self.loader.try_call(self.load_object, config, dangers.SECTION)
        if self.bglogger is not None:
            pconfig.log_config(config)
        self.loader.load_all(config)

    def _connect(self, eventtime):
        try:
            self.load()
            for event in ("klippy:mcu_identify", "klippy:connect"):
                for callback in list(self.event_handlers.get(event, ())):
                    if self.state != "startup":
                        return
                    callback()
        except ConfigError as err:
            self._fail_start(err, HINT_CONFIG)
        except McuError as err:
            self._fail_start(err, HINT_MCU)
            self._send_protected("klippy:notify_mcu_error", str(err),
                                 err.details or {"error": str(err)})
        except PrinterError as err:
            self._fail_start(err, HINT_CONFIG)
        else:
            self._announce_ready()

    def _fail_start(self, err, hint):
        logging.error("the printer cannot start:\n%s", err)
        self.load_errors = err.errors if isinstance(err, ConfigErrors) else [err]
        self._set_state("error", "%s\n%s" % (err, hint))

    def _announce_ready(self):
        self._set_state("ready", MESSAGE_READY)
        for callback in list(self.event_handlers.get("klippy:ready", ())):
            if self.state != "ready":
                return
            callback()

    # Shutdown and end

    def invoke_shutdown(self, msg, details=None):
        """Stop the printer at once.  details: more facts for the analysis."""
        self._shut_down(msg, details or {}, HINT_SHUTDOWN)

    def _shut_down(self, msg, details, hint):
        if self.in_shutdown_state:
            return
        logging.error("the printer shuts down at eventtime %.6f: %s",
                      self.reactor.monotonic(), msg)
        self.in_shutdown_state = True
        self._set_state("shutdown", "%s\n%s" % (msg, hint))
        self._send_protected("klippy:shutdown")
        self.reactor.register_callback(
            lambda eventtime: self._send_protected("klippy:analyze_shutdown", msg,
                                                   details))

    def invoke_async_shutdown(self, msg, details=None):
        """As invoke_shutdown(), from any thread."""
        self.reactor.register_async_callback(
            lambda eventtime: self.invoke_shutdown(msg, details))

    def _handle_internal_error(self, err):
        """A callback of the reactor raised."""
        hint = HINT_SHUTDOWN if isinstance(err, PrinterError) else HINT_INTERNAL
        self._shut_down(_describe(err), {}, hint)

    def request_exit(self, result):
        """Have run() return result; the first one asked for counts."""
        if self.run_result is None:
            self.run_result = result
        self.reactor.end()


def _describe(err):
    if isinstance(err, PrinterError):
        return str(err)
    return "Internal error: %s: %s" % (type(err).__name__, err)


