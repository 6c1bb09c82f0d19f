# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow that follows the measured width of filament, with its way to the nozzle.

Widths are noted as filament passes the sensor, and used measurement_delay mm later.
The same amount of plastic needs (nominal / width)^2 times the length.
"""
from collections import deque

from klippy.errors import CommandError

PERIOD = 1.0                # s
# Flow that differs by less than this is the same (%)
SMALLEST_CHANGE = 0.5


class WidthTrack:
    """Widths on their way to the nozzle."""

    def __init__(self, delay, interval):
        """delay: mm from sensor to nozzle; interval: mm between two widths."""
        self.delay, self.interval = delay, interval
        self.passing = deque()           # (filament position at the nozzle, mm)
        self.width = None                # mm, at the nozzle

    def clear(self):
        """Forget all widths."""
        self.passing.clear()
        self.width = None

    def note_width(self, position, width):
        """width is at the sensor now that the extruder has pushed `position` mm."""
        while self.passing and self.passing[0][0] <= position:
            self.width = self.passing.popleft()[1]
        if not self.passing or (
                position + self.delay - self.passing[-1][0] >= self.interval):
            self.passing.append((position + self.delay, width))

    def get_next(self):
        """mm that come to the nozzle next; None if nothing was measured."""
        return self.passing[0][1] if self.passing else None


class FlowControl:
    """Measures once a second while it is on, and sets the flow (M221)."""

    def __init__(self, config, measure, interval, max_difference):
        """measure() -> mm, None before the first reading.

        interval: mm between two widths; max_difference: mm from nominal.
        """
        self.printer = printer = config.get_printer()
        self.reactor = printer.get_reactor()
        self.gcode = printer.lookup_object("gcode")
        self.measure, self.max_difference = measure, max_difference
        self.nominal = config.getfloat("default_nominal_filament_diameter", above=1.0)
        self.track = WidthTrack(config.getfloat("measurement_delay", above=0.0),
                                interval)
        self.is_active = False
        self.is_compensating = True
        # widths from before the first has reached the nozzle count at once
        self.uses_passing = False
        self.percent = 100.0
        self.timer = self.reactor.register_timer(self._update)
        self.on_measured = lambda eventtime, width: None
        register = self.gcode.register_command
        for name in ("QUERY_FILAMENT_WIDTH", "RESET_FILAMENT_WIDTH_SENSOR",
                     "DISABLE_FILAMENT_WIDTH_SENSOR", "ENABLE_FILAMENT_WIDTH_SENSOR"):
            register(name, getattr(self, "cmd_" + name),
                     desc=getattr(self, "cmd_%s_help" % name))

    def start(self):
        """Measure from now on."""
        self.is_active = True
        self.reactor.update_timer(self.timer, self.reactor.NOW)

    def stop(self):
        """Measure no more; the flow is what the file says."""
        self.is_active = False
        self.reactor.update_timer(self.timer, self.reactor.NEVER)
        self.track.clear()
        self._set_percent(100.0)

    def _find_position(self, eventtime):
        extruder = self.printer.lookup_object("toolhead").get_extruder()
        mcu = self.printer.lookup_object("mcu")
        return extruder.find_past_position(mcu.estimated_print_time(eventtime))

    def _update(self, eventtime):
        width = self.measure()
        if width is not None:
            self._note_width(eventtime, width)
        return eventtime + PERIOD if self.is_active else self.reactor.NEVER

    def _note_width(self, eventtime, width):
        self.on_measured(eventtime, width)
        self.track.note_width(self._find_position(eventtime), width)
        if self.is_compensating:
            self._set_percent(self.calc_percent())

    def calc_percent(self):
        """Flow for the filament at the nozzle; 100 if that cannot be right."""
        width = self.track.width
        if width is None and self.uses_passing:
            width = self.track.get_next()
        if width is None or abs(width - self.nominal) > self.max_difference:
            return 100.0
        return 100.0 * (self.nominal / width) ** 2

    def _set_percent(self, percent):
        if percent != 100.0 and abs(percent - self.percent) < SMALLEST_CHANGE:
            return
        if percent == self.percent:
            return
        self.percent = percent
        self.reactor.register_callback(
            lambda eventtime: self._send("M221 S%.1f" % (percent,)))

    def _send(self, script):
        try:
            self.gcode.run_script(script)
        except CommandError as err:
            self.gcode.respond_raw("!! Filament width: %s" % (err,))

    cmd_QUERY_FILAMENT_WIDTH_help = "Report the measured filament width"

    def cmd_QUERY_FILAMENT_WIDTH(self, gcmd):
        width = self.measure()
        if width is not None and width > 0.0:
            gcmd.respond_info("Filament dia (measured mm): %.2f" % (width,))
        else:
            gcmd.respond_info("Filament NOT present")

    cmd_RESET_FILAMENT_WIDTH_SENSOR_help = "Forget all measured widths"

    def cmd_RESET_FILAMENT_WIDTH_SENSOR(self, gcmd):
        self.track.clear()
        gcmd.respond_info("Filament width measurements cleared")
        self._set_percent(100.0)

    cmd_DISABLE_FILAMENT_WIDTH_SENSOR_help = "Measure no filament width any more"

    def cmd_DISABLE_FILAMENT_WIDTH_SENSOR(self, gcmd):
        if self.is_active:
            self.stop()
            gcmd.respond_info("Filament width sensor turned off")
        else:
            gcmd.respond_info("Filament width sensor is off already")

    cmd_ENABLE_FILAMENT_WIDTH_SENSOR_help = "Measure the filament width"

    def cmd_ENABLE_FILAMENT_WIDTH_SENSOR(self, gcmd):
        compensate = gcmd.get_int("FLOW_COMPENSATION", None, minval=0, maxval=1)
        if compensate is not None:
            self.is_compensating = bool(compensate)
            if not compensate:
                self._set_percent(100.0)
        if self.is_active:
            gcmd.respond_info("Filament width sensor is on already")
        else:
            self.start()
            gcmd.respond_info("Filament width sensor turned on")
