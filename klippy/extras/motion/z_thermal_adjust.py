# SPDX-License-Identifier: GPL-3.0-or-later
"""[z_thermal_adjust]: follows in z how a frame grows with its temperature.

Sections [z_thermal_adjust <name>] are for more parts that grow; all add up.

The head goes down by temp_coeff mm a degC that the frame is warmer than when z
was homed.  Every move takes the adjustment of its time along.  Until z is
homed, or a temperature is given, there is nothing to compare with.
"""

from klippy import dangers

ABSOLUTE_ZERO = -273.15
NO_LIMIT = 99999999.
Z_AXIS = 2


class SmoothedSensor:
    """Readings of a sensor in degC: the last one, extremes, and a slow mean."""

    def __init__(self, smooth_time):
        """smooth_time: s in which the mean follows a change."""
        self.smooth_time = smooth_time
        self.last = self.mean = 0.
        self.last_time = None
        self.extremes = NO_LIMIT, 0.

    def note(self, read_time, temp):
        """Take a reading; called by the sensor."""
        if not temp:
            return
        if self.last_time is None:
            self.mean, self.extremes = temp, (temp, temp)
        else:
            share = min((read_time - self.last_time) / self.smooth_time, 1.)
            self.mean += (temp - self.mean) * share
        self.last, self.last_time = temp, read_time
        self.extremes = (min(self.extremes[0], self.mean),
                         max(self.extremes[1], self.mean))


class ZThermalAdjust:
    """Object z_thermal_adjust: a transform of the moves and a sensor.

    Status: temperature (smoothed), measured_min_temp, measured_max_temp,
    current_z_adjust (mm), z_adjust_ref_temperature, enabled.
    """

    def __init__(self, config):
        self.printer, self.name = config.get_printer(), config.get_name()
        self.temp_coeff = config.getfloat("temp_coeff", 0., minval=-1., maxval=1.)
        self.off_above = config.getfloat("z_adjust_off_above", NO_LIMIT)
        self.max_adjust = config.getfloat("max_z_adjustment", NO_LIMIT)
        self.readings = SmoothedSensor(config.getfloat("smooth_time", 2., above=0.))
        self.is_enabled = True
        self.ref_temp, self.is_ref_given = None, False
        self.z_adjust = 0.
        self.next_transform = None
        self.gcode_move = self.printer.load_object(config, "gcode_move")
        self._setup_sensor(config)
        self._register()

    def _setup_sensor(self, config):
        heaters = self.printer.load_object(config, "heaters")
        sensor = heaters.setup_sensor(config)
        low = config.getfloat("min_temp", minval=ABSOLUTE_ZERO)
        high = config.getfloat("max_temp", above=low)
        if not dangers.get(self.printer).temp_ignore_limits:
            sensor.setup_minmax(low, high)
        sensor.setup_callback(self.readings.note)
        heaters.register_sensor(config, self)

    def _register(self):
        register = self.printer.register_event_handler
        register("klippy:connect", self._handle_connect)
        register("homing:home_rails_end", self._handle_home_rails_end)
        register("stepper_enable:motor_off", self._handle_motor_off)
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_Z_THERMAL_ADJUST", "COMPONENT", self.name.partition(" ")[2] or None,
            self.cmd_SET_Z_THERMAL_ADJUST, desc=self.cmd_SET_Z_THERMAL_ADJUST_help)

    def get_temp(self, eventtime):
        """(smoothed reading in degC, 0: it has no target)."""
        return self.readings.mean, 0.

    def stats(self, eventtime):
        """(is active, line for the log)."""
        return False, "%s: temp=%.1f z=%.4f" % (
            self.name, self.readings.mean, self.z_adjust)

    def get_status(self, eventtime):
        low, high = self.readings.extremes
        return {"temperature": round(self.readings.mean, 2),
                "measured_min_temp": round(low, 2),
                "measured_max_temp": round(high, 2),
                "current_z_adjust": self.z_adjust,
                "z_adjust_ref_temperature": self.ref_temp or 0.,
                "enabled": self.is_enabled}

    # Events

    def _handle_connect(self):
        self.next_transform = self.gcode_move.set_move_transform(self, force=True)

    def _handle_home_rails_end(self, homing_state, rails):
        if Z_AXIS not in homing_state.get_axes():
            return
        self.z_adjust = 0.
        if self.readings.last_time is not None:
            self.ref_temp, self.is_ref_given = self.readings.mean, False
        self.gcode_move.reset_last_position()

    def _handle_motor_off(self, print_time):
        # z is not homed any more: it may not be moved by itself
        if not self.is_ref_given:
            self.ref_temp = None

    # The transform

    def get_position(self):
        """Position without the adjustment."""
        position = list(self.next_transform.get_position())
        position[Z_AXIS] -= self.z_adjust
        return position

    def move(self, newpos, speed):
        """Go to a position with the adjustment that is due now."""
        if (self.is_enabled and self.ref_temp is not None
                and newpos[Z_AXIS] < self.off_above):
            way = -self.temp_coeff * (self.readings.mean - self.ref_temp)
            self.z_adjust = max(-self.max_adjust, min(way, self.max_adjust))
        position = list(newpos)
        position[Z_AXIS] += self.z_adjust
        self.next_transform.move(position, speed)

    # Command

    cmd_SET_Z_THERMAL_ADJUST_help = "Set or show what is done about a growing frame"

    def cmd_SET_Z_THERMAL_ADJUST(self, gcmd):
        """ENABLE, TEMP_COEFF, REF_TEMP; a disabled adjustment stays as it is."""
        enable = gcmd.get_int("ENABLE", None, minval=0, maxval=1)
        coeff = gcmd.get_float("TEMP_COEFF", None, minval=-1., maxval=1.)
        ref_temp = gcmd.get_float("REF_TEMP", None, minval=ABSOLUTE_ZERO)
        if ref_temp is not None:
            self.ref_temp, self.is_ref_given = ref_temp, True
        if coeff is not None:
            self.temp_coeff = coeff
        if enable is not None:
            self.is_enabled = bool(enable)
        reference = ("unknown" if self.ref_temp is None else "%.2f degC (%s)" % (
            self.ref_temp, "given" if self.is_ref_given else "homing"))
        gcmd.respond_info(
            "enable: %s\ntemp_coeff: %f mm/degC\nref_temp: %s\n"
            "current_z_adjust: %.4f mm\ntemperature: %.2f degC"
            % (self.is_enabled, self.temp_coeff, reference, self.z_adjust,
               self.readings.mean))


def load_config(config):
    return ZThermalAdjust(config)


load_config_prefix = load_config
