# SPDX-License-Identifier: GPL-3.0-or-later
"""What takes heat from a heater: a fan, filament, the room.

All of it is looked at on the main thread, four times a second, and kept for
the control, which runs where readings arrive.
"""

from klippy.mcu import absence

SAMPLE_TIME = 0.25
# Filament faster than this (mm/s) is an extruder that was set anew
MAX_FILAMENT_SPEED = 200.0


class FilamentFlow:
    """Filament that enters a heater, from positions of its extruder (mm).

    Filament that was pulled back and comes again is warm: only what goes
    further than ever before counts.  It forgets what was pulled back by more
    than max_retract, as that has cooled down.
    """

    def __init__(self, max_retract):
        self.max_retract = max_retract
        self.furthest = None
        self.speed = 0.0

    def note_position(self, position, elapsed):
        """Take the position reached `elapsed` s after the one before."""
        if self.furthest is None or elapsed <= 0.0:
            self.furthest = position
            return
        fresh = max(position - self.furthest, 0.0)
        self.furthest = min(max(self.furthest, position),
                            position + self.max_retract)
        speed = fresh / elapsed
        self.speed = speed if speed <= MAX_FILAMENT_SPEED else 0.0


class HeaterSurroundings:
    """fan_speed (0..1), filament_speed (mm/s) and room (degC or None)."""

    def __init__(self, config, fan_name, sensor_name, max_retract):
        self.printer = config.get_printer()
        self.section = config.get_name()
        self.fan_name, self.sensor_name = fan_name, sensor_name
        self.flow = FilamentFlow(max_retract)
        self.fan = self.sensor = self.extruder = None
        self.fan_speed = 0.0
        self.room = None
        self.lead_time = 0.0
        self.last_time = 0.0
        self.printer.register_event_handler(
            "klippy:connect", self._handle_connect)

    @property
    def filament_speed(self):
        return self.flow.speed

    def _handle_connect(self):
        self.fan = self._find("cooling_fan", self.fan_name, "fan")
        self.sensor = self._find("ambient_temp_sensor", self.sensor_name,
                                 "get_temp")
        extruder = self.printer.lookup_object(self.section, None)
        if hasattr(extruder, "find_past_position"):
            self.extruder = extruder
        if self.printer.get_start_args().get("debugoutput") is None:
            reactor = self.printer.get_reactor()
            reactor.register_timer(self._sample, reactor.NOW)

    def watch_hotend(self, name, fan_name):
        """Look at the extruder of that name, and at a fan (None: at none)."""
        extruder = self.printer.lookup_object(name, None)
        if hasattr(extruder, "find_past_position"):
            self.extruder = extruder
        fan = self.printer.lookup_object(fan_name, None) if fan_name else None
        if hasattr(fan, "fan"):
            self.fan = fan

    def _find(self, option, name, attribute):
        if name is None:
            return None
        found = self.printer.lookup_object(name, None)
        if not hasattr(found, attribute):
            raise self.printer.config_error(
                "Option '%s' in section '%s': there is no section [%s] that could"
                " serve as that" % (option, self.section, name))
        return found

    def _sample(self, eventtime):
        if self.fan is not None:
            self.fan_speed = self.fan.fan.last_speed
        if self.sensor is not None:
            is_blind = absence.is_absent(getattr(self.sensor, "part", None))
            self.room = None if is_blind else self.sensor.get_temp(eventtime)[0]
        if self.extruder is not None:
            self._sample_filament(eventtime)
        return eventtime + SAMPLE_TIME

    def _sample_filament(self, eventtime):
        mcu = self.printer.lookup_object("mcu")
        print_time = mcu.estimated_print_time(eventtime) + self.lead_time
        self.flow.note_position(self.extruder.find_past_position(print_time),
                                print_time - self.last_time)
        self.last_time = print_time
