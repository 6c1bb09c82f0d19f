# SPDX-License-Identifier: GPL-3.0-or-later
"""COLD_EXTRUDE, M302 and SET_SMOOTH_TIME: limits of heaters changed while they work.

What is set holds until the next restart.
"""

from klippy.extras.control_pid import ControlPID
from klippy.record import replace

MIN_SMOOTH_TIME = 0.001     # s; 0 means: no smoothing at all


class HeaterTuning:
    """The commands, for all heaters."""

    def __init__(self, config):
        self.printer = config.get_printer()
        self.heaters = {}
        self.smooth_times = {}      # of the config, by the heater's name
        self.gcode = self.printer.lookup_object("gcode")
        self.gcode.register_command("M302", self.cmd_M302, yields=True)

    def add_heater(self, heater):
        """Called by a heater once it is set up."""
        self.heaters[heater.short_name] = heater
        self.smooth_times[heater.short_name] = heater.limits.smooth_time
        for command, handler in (("COLD_EXTRUDE", self.cmd_COLD_EXTRUDE),
                                 ("SET_SMOOTH_TIME", self.cmd_SET_SMOOTH_TIME)):
            self.gcode.register_mux_command(
                command, "HEATER", heater.short_name, handler,
                desc=getattr(self, "cmd_%s_help" % (command,)), yields=True)

    cmd_COLD_EXTRUDE_help = "Allow an extruder to move filament while it is cold"

    def cmd_COLD_EXTRUDE(self, gcmd):
        heater = self.heaters[gcmd.get("HEATER")]
        self._set_extrusion(gcmd, heater, gcmd.get_int("ENABLE", None, 0, 1),
                            gcmd.get_float("MIN_EXTRUDE_TEMP", None,
                                           heater.min_temp, heater.max_temp))

    def cmd_M302(self, gcmd):
        """P: 1 allows, 0 forbids cold extrusion; S: least temperature for it."""
        index = gcmd.get_int("T", None, minval=0)
        if index is None:
            extruder = self.printer.lookup_object("toolhead").get_extruder()
        else:
            name = "extruder%d" % (index,) if index else "extruder"
            extruder = self.printer.lookup_object(name, None)
        heater = extruder.get_heater() if extruder is not None else None
        if heater is None:
            raise gcmd.error("'%s': there is no such extruder"
                             % (gcmd.get_commandline(),))
        self._set_extrusion(gcmd, heater, gcmd.get_int("P", None, 0, 1),
                            gcmd.get_float("S", None, 0., heater.max_temp))

    def _set_extrusion(self, gcmd, heater, is_allowed, min_temp):
        """Set what is not None; tell what holds if both are."""
        if is_allowed is None and min_temp is None:
            gcmd.respond_info(
                "Heater '%s': cold extrusion is %s, min_extrude_temp is %.1f" % (
                    heater.short_name, "on" if heater.is_cold_allowed else "off",
                    heater.limits.min_extrude_temp))
            return
        self._wait_for_moves()
        heater.set_extrusion_limit(min_temp, is_allowed)

    def _wait_for_moves(self):
        """What comes before was planned with the limits before."""
        toolhead = self.printer.lookup_object("toolhead", None)
        if toolhead is not None:
            toolhead.get_last_move_time()

    cmd_SET_SMOOTH_TIME_help = "Set the time that readings are averaged over"

    def cmd_SET_SMOOTH_TIME(self, gcmd):
        name = gcmd.get("HEATER")
        heater = self.heaters[name]
        value = max(gcmd.get_float("SMOOTH_TIME", self.smooth_times[name], minval=0.),
                    MIN_SMOOTH_TIME)
        is_saved = gcmd.get_int("SAVE_TO_PROFILE", 0, 0, 1)
        profiles = heater.profiles.heaters[name]
        is_pid = isinstance(heater.control, ControlPID)
        if is_saved and not is_pid:
            raise gcmd.error("Heater '%s' has no smooth time to save in a profile:"
                             " that needs 'control: pid'" % (name,))
        heater.set_smooth_time(value)
        if is_pid:
            profiles.set_gains(heater.control.get_gains(), value)
            profiles.origin = replace(profiles.origin, smooth_time=value)
        if is_saved:
            heater.profiles.store(heater, profiles.loaded, profiles.get_current())


def load_config(config):
    return HeaterTuning(config)
