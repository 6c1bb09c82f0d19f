# SPDX-License-Identifier: GPL-3.0-or-later
"""PID temperature control.

pid_kp, pid_ki and pid_kd are in units of 1/255 of full power per degC,
degC*s and degC/s, as every printer.cfg of the field has them.
"""

PARAMETER_BASE = 255.0
START_TEMP = 25.0
SETTLED_DELTA = 1.0
SETTLED_SLOPE = 0.1
OPTIONS = ("pid_kp", "pid_ki", "pid_kd")


class ControlPID:
    """PID with a filtered derivative and a clamped integral.

    The integral only moves while the output is not saturated in its
    direction, so that a long climb does not wind it up.
    """

    def __init__(self, heater, config):
        self._setup(heater, [config.getfloat(name) for name in OPTIONS])
        # Written by calibrations of others; nothing depends on them
        config.getint("pid_version", 1)
        config.getfloat("pid_target", None)
        config.getfloat("pid_tolerance", None)

    @classmethod
    def from_gains(cls, heater, gains, smooth_time=None):
        """A control with gains (kp, ki, kd) as a printer.cfg has them.

        smooth_time: s of the derivative, None for that of the heater.
        """
        control = cls.__new__(cls)
        control._setup(heater, gains)
        control.set_gains(gains, smooth_time)
        return control

    def _setup(self, heater, gains):
        self.heater = heater
        self.max_power = heater.get_max_power()
        self.min_deriv_time = heater.get_smooth_time()
        self.last_temp = START_TEMP
        self.last_time = self.last_error = 0.0
        self.slope = 0.0
        self.integral = 0.0
        self._store_gains(gains)

    def _store_gains(self, gains):
        self.kp, self.ki, self.kd = [gain / PARAMETER_BASE for gain in gains]
        self.max_integral = self.max_power / self.ki if self.ki else 0.0

    def get_gains(self):
        """(kp, ki, kd) as a printer.cfg has them."""
        return tuple(PARAMETER_BASE * gain for gain in (self.kp, self.ki, self.kd))

    def set_gains(self, gains, smooth_time=None):
        """Go on with other gains (kp, ki, kd) and the power of the last reading.

        What the new gains would change in power the integral takes up, within its
        limits.  An output at its limit says nothing about the power that is
        needed: then the share of the integral stays what it was.
        smooth_time: as of from_gains.
        """
        if smooth_time is None:
            smooth_time = self.heater.get_smooth_time()
        share = self.ki * self.integral
        before = self.kp * self.last_error + share - self.kd * self.slope
        self._store_gains(gains)
        self.min_deriv_time = smooth_time
        if 0.0 < before < self.max_power:
            share = before - self.kp * self.last_error + self.kd * self.slope
        self.integral = 0.0
        if self.ki:
            self.integral = min(max(share / self.ki, 0.0), self.max_integral)

    def begin(self, read_time, temp):
        """There was a reading (print_time, degC) before this control."""
        self.last_time, self.last_temp = read_time, temp

    def note_hold(self, duration):
        """print_time stood still for so many s."""
        self.last_time -= duration

    def temperature_update(self, read_time, temp, target_temp):
        """Answer a reading (degC) with a power for the heater."""
        elapsed = read_time - self.last_time
        slope = self._calc_slope(temp, elapsed)
        self.last_error = error = target_temp - temp
        integral = self.integral + error * elapsed
        integral = min(max(integral, 0.0), self.max_integral)
        wanted = self.kp * error + self.ki * integral - self.kd * slope
        power = min(max(wanted, 0.0), self.max_power)
        self.heater.set_pwm(read_time, power)
        self.last_temp, self.last_time, self.slope = temp, read_time, slope
        if power == wanted:
            self.integral = integral

    def _calc_slope(self, temp, elapsed):
        change = temp - self.last_temp
        if elapsed >= self.min_deriv_time:
            return change / elapsed
        keep = self.slope * (self.min_deriv_time - elapsed)
        return (keep + change) / self.min_deriv_time

    def check_busy(self, eventtime, smoothed_temp, target_temp):
        """True until the temperature is at the target and steady."""
        return (abs(target_temp - smoothed_temp) > SETTLED_DELTA
                or abs(self.slope) > SETTLED_SLOPE)
