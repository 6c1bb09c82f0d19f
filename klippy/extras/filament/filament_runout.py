# SPDX-License-Identifier: GPL-3.0-or-later
"""What a filament sensor sets off: pause, runout_gcode and insert_gcode.

A runout counts while something prints, an insertion while nothing does.  Sensors tell
note_filament_present(); everything else happens here.
"""

import logging

from klippy.errors import CommandError
from klippy.record import record

# Sensors settle so long after the start (s)
START_DELAY = 2.0
# How often the filament that still runs is looked at (s)
DISTANCE_PERIOD = 0.1


@record
class RunoutOptions:
    """Options that SET_FILAMENT_SENSOR can change; mm."""

    enabled: bool = True
    smart: bool = False
    always_fire_events: bool = False
    check_on_print_start: bool = False
    runout_distance: float = 0.0

    @classmethod
    def from_config(cls, config, has_distance):
        options = cls(smart=config.getboolean("smart", False),
                      always_fire_events=config.getboolean("always_fire_events", False))
        if has_distance:
            options.runout_distance = config.getfloat(
                "runout_distance", 0.0, minval=0.0)
            options.check_on_print_start = config.getboolean(
                "check_on_print_start", False)
        return options


class RunoutHelper:
    """Status: filament_detected, enabled, and the options that commands change.

    Events: filament:runout and filament:insert with (eventtime, sensor name).
    """

    def __init__(self, config, has_distance=True):
        """has_distance: whether the section may have the filament run on."""
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.name = config.get_name().split()[-1]
        self.has_distance = has_distance
        self.options = RunoutOptions.from_config(config, has_distance)
        self.pause_delay = config.getfloat("pause_delay", 0.5, minval=0.0)
        self.event_delay = config.getfloat("event_delay", 3.0, minval=0.0)
        self._read_scripts(config)
        self.filament_present = False
        self.min_event_time = self.reactor.NEVER
        # Filament position at which it ran out, while it is used up
        self.runout_start = None
        self.runout_elapsed = 0.0
        self.timer = self.reactor.register_timer(self._check_distance)
        # What of an mcu the sensor is: without it there is nothing to react to
        self.part = None
        # A sensor's own part of SET_FILAMENT_SENSOR
        self.on_set = lambda gcmd: None
        self.on_reset = lambda eventtime: None
        register = printer.register_event_handler
        register("klippy:ready", self._handle_ready)
        register("idle_timeout:printing", self._handle_printing)
        for name, handler in (("QUERY_FILAMENT_SENSOR", self.cmd_QUERY_FILAMENT_SENSOR),
                              ("SET_FILAMENT_SENSOR", self.cmd_SET_FILAMENT_SENSOR)):
            self.gcode.register_mux_command(name, "SENSOR", self.name, handler,
                                            desc=getattr(self, "cmd_%s_help" % name))

    def _read_scripts(self, config):
        macros = self.printer.load_object(config, "gcode_macro")
        self.runout_pause = config.getboolean("pause_on_runout", True)
        if self.runout_pause:
            self.printer.load_object(config, "pause_resume")
        self.printer.load_object(config, "idle_timeout")
        self.runout_gcode = self.insert_gcode = self.immediate_gcode = None
        if self.runout_pause or config.get("runout_gcode", None) is not None:
            self.runout_gcode = macros.load_template(config, "runout_gcode", "")
        if config.get("insert_gcode", None) is not None:
            self.insert_gcode = macros.load_template(config, "insert_gcode")
        if self.has_distance and config.get("immediate_runout_gcode", None) is not None:
            self.immediate_gcode = macros.load_template(
                config, "immediate_runout_gcode")

    def _handle_ready(self):
        self.min_event_time = self.reactor.monotonic() + START_DELAY

    # What the printer does

    def _is_printing(self, eventtime):
        if self.options.smart:
            v_sd = self.printer.lookup_object("virtual_sdcard", None)
            return v_sd is not None and v_sd.is_active()
        idle = self.printer.lookup_object("idle_timeout")
        return idle.get_status(eventtime)["state"] == "Printing"

    def _handle_printing(self, print_time):
        if not self.options.check_on_print_start or self.filament_present:
            return
        self.reactor.register_callback(self._check_start)

    def _check_start(self, eventtime):
        """A print starts without filament."""
        if (self.is_enabled() and not self.filament_present
                and eventtime >= self.min_event_time and self._is_printing(eventtime)):
            self._begin_runout(eventtime)

    def find_filament_position(self, eventtime):
        """mm of filament that the active extruder has pushed."""
        extruder = self.printer.lookup_object("toolhead").get_extruder()
        mcu = self.printer.lookup_object("mcu")
        return extruder.find_past_position(mcu.estimated_print_time(eventtime))

    # What the sensor sees

    def note_filament_present(self, eventtime, is_filament_present=None):
        """The sensor sees filament, or none; may be called any number of times.

        The older form note_filament_present(is_filament_present) means now.
        """
        if is_filament_present is None:
            eventtime, is_filament_present = self.reactor.monotonic(), eventtime
        if is_filament_present == self.filament_present:
            return
        self.filament_present = is_filament_present
        self._fire_event(eventtime)
        if eventtime < self.min_event_time or not self.is_enabled():
            return
        is_printing = self._is_printing(eventtime)
        if is_filament_present:
            if self.runout_start is not None:
                # came back while the rest was used up: a false alarm
                self._end_distance()
            if not is_printing and self.insert_gcode is not None:
                self.min_event_time = self.reactor.NEVER
                logging.info("Filament sensor %s: insert event detected", self.name)
                self.reactor.register_callback(self._run_insert)
        elif is_printing and self.runout_gcode is not None:
            self._begin_runout(eventtime)

    def _fire_event(self, eventtime):
        if eventtime < self.min_event_time and not self.options.always_fire_events:
            return
        if self.is_enabled() or self.options.always_fire_events:
            kind = "insert" if self.filament_present else "runout"
            self.printer.send_event("filament:" + kind, eventtime, self.name)

    def _begin_runout(self, eventtime):
        logging.info("Filament sensor %s: runout event detected", self.name)
        if self.immediate_gcode is not None:
            self.reactor.register_callback(
                lambda now: self._run_script("", self.immediate_gcode))
        if self.options.runout_distance <= 0.0:
            self._finish_runout()
            return
        if self.runout_start is None:
            self.runout_start = self.find_filament_position(eventtime)
            self.reactor.update_timer(self.timer, self.reactor.NOW)

    def _check_distance(self, eventtime):
        """Let the filament behind the sensor be used up."""
        if self.runout_start is None:
            return self.reactor.NEVER
        position = self.find_filament_position(eventtime)
        self.runout_elapsed = max(self.runout_elapsed, position - self.runout_start)
        if self.runout_elapsed < self.options.runout_distance:
            return eventtime + DISTANCE_PERIOD
        self._end_distance()
        if self.is_enabled():
            self._finish_runout()
        return self.reactor.NEVER

    def _end_distance(self):
        self.runout_start, self.runout_elapsed = None, 0.0

    def _finish_runout(self):
        if self.runout_gcode is None:
            return
        self.min_event_time = self.reactor.NEVER
        self.reactor.register_callback(self._run_runout)

    def _run_runout(self, eventtime):
        prefix = ""
        if self.runout_pause:
            pause_resume = self.printer.lookup_object("pause_resume")
            pause_resume.send_pause_command()
            prefix = "PAUSE\n"
            self.reactor.pause(eventtime + self.pause_delay)
        self._run_script(prefix, self.runout_gcode)
        self._open_events()

    def _run_insert(self, eventtime):
        self._run_script("", self.insert_gcode)
        self._open_events()

    def _open_events(self):
        self.min_event_time = self.reactor.monotonic() + self.event_delay

    def _run_script(self, prefix, template):
        """What is wrong in a script is told, and stops nothing else."""
        try:
            self.gcode.run_script(prefix + template.render() + "\nM400")
        except CommandError as err:
            logging.warning("Filament sensor %s: %s", self.name, err)
            self.gcode.respond_raw("!! Filament sensor %s: %s" % (self.name, err))

    # Users

    def is_enabled(self):
        """True if it is on, and there is something to sense with."""
        return bool(self.options.enabled) and getattr(self.part, "lack", None) is None

    @property
    def sensor_enabled(self):
        """Whether the sensor is on; plug-ins assign it."""
        return self.options.enabled

    @sensor_enabled.setter
    def sensor_enabled(self, value):
        self.options.enabled = bool(value)

    def get_status(self, eventtime):
        options = self.options
        status = {"filament_detected": bool(self.filament_present),
                  "enabled": self.is_enabled(), "smart": options.smart,
                  "always_fire_events": options.always_fire_events}
        if self.has_distance:
            status.update(runout_distance=options.runout_distance,
                          runout_elapsed=self.runout_elapsed,
                          check_on_print_start=options.check_on_print_start)
        return status

    cmd_QUERY_FILAMENT_SENSOR_help = "Query the status of the Filament Sensor"

    def cmd_QUERY_FILAMENT_SENSOR(self, gcmd):
        gcmd.respond_info("Filament Sensor %s: filament %s" % (
            self.name, "detected" if self.filament_present else "not detected"))

    cmd_SET_FILAMENT_SENSOR_help = "Turn the filament sensor on or off, set its options"

    def cmd_SET_FILAMENT_SENSOR(self, gcmd):
        params = set(gcmd.get_command_parameters()) - {"SENSOR"}
        options = self.options
        if "ENABLE" in params or not params:
            options.enabled = bool(gcmd.get_int("ENABLE", 1))
        flags = ["smart", "always_fire_events"]
        if self.has_distance:
            flags.append("check_on_print_start")
            options.runout_distance = gcmd.get_float(
                "RUNOUT_DISTANCE", options.runout_distance, minval=0.0)
        for flag in flags:
            value = gcmd.get_int(flag.upper(), None, minval=0, maxval=1)
            if value is not None:
                setattr(options, flag, bool(value))
        self.on_set(gcmd)
        if gcmd.get_int("RESET", 0, minval=0, maxval=1):
            self._reset()

    def _reset(self):
        """Forget a runout that is under way; what the sensor sees counts anew."""
        self._end_distance()
        self.on_reset(self.reactor.monotonic())
