# SPDX-License-Identifier: GPL-3.0-or-later
"""SET_TEMPERATURE_FAN_CURVE: another curve for a [temperature_fan] at work."""


def parse_points(text):
    """[(degC, speed)] of "40:0, 50:0.3".  Raises ValueError."""
    points = []
    for part in text.split(","):
        temp, mark, speed = part.partition(":")
        if not mark:
            raise ValueError("'%s' is no point, write degrees:speed" % part.strip())
        points.append((float(temp), float(speed)))
    return points


class CurveCommand:
    """The command, for one fan."""

    def __init__(self, owner):
        self.owner = owner
        self.printer = owner.printer
        self.printer.lookup_object("gcode").register_mux_command(
            "SET_TEMPERATURE_FAN_CURVE", "TEMPERATURE_FAN", owner.name,
            self.cmd_SET_TEMPERATURE_FAN_CURVE,
            desc=self.cmd_SET_TEMPERATURE_FAN_CURVE_help)

    cmd_SET_TEMPERATURE_FAN_CURVE_help = (
        "Change or show the curve of a temperature fan")

    def cmd_SET_TEMPERATURE_FAN_CURVE(self, gcmd):
        control = self.owner.control
        text = gcmd.get("POINTS", None)
        target = gcmd.get_float("TARGET", self.owner.target_temp)
        smoothing = (
            gcmd.get_int("SMOOTH_READINGS", control.readings.maxlen, minval=0),
            gcmd.get_float("COOLING_HYSTERESIS", control.cooling, minval=0.0),
            gcmd.get_float("HEATING_HYSTERESIS", control.heating, minval=0.0))
        is_saved = gcmd.get_int("SAVE", 0, minval=0, maxval=1)
        before = control.points
        try:
            points = before if text is None else parse_points(text)
            if text is not None or "TARGET" in gcmd.get_command_parameters():
                control.set_points(points, target)
        except ValueError as err:
            raise gcmd.error("SET_TEMPERATURE_FAN_CURVE POINTS='%s': %s"
                             % (text or describe_points(before), err)) from err
        try:
            self.owner.set_temp(target)
        except self.printer.command_error:
            control.points = before
            raise
        control.set_smoothing(*smoothing)
        if is_saved:
            self._save(control)
        gcmd.respond_info("temperature_fan '%s': %s, full speed from %.1f on" % (
            self.owner.name, describe_points(control.points), self.owner.target_temp))

    def _save(self, control):
        """Have SAVE_CONFIG keep what is in use now."""
        values = {
            "points": "\n" + "\n".join("%g, %g" % point for point in control.points),
            "target_temp": "%g" % self.owner.target_temp,
            "smooth_readings": "%d" % control.readings.maxlen,
            "cooling_hysteresis": "%g" % control.cooling,
            "heating_hysteresis": "%g" % control.heating}
        configfile = self.printer.lookup_object("configfile")
        for option, value in values.items():
            configfile.set("temperature_fan " + self.owner.name, option, value)


def describe_points(points):
    return ", ".join("%g:%g" % point for point in points)
