# SPDX-License-Identifier: GPL-3.0-or-later
"""PID temperature control.

pid_kp, pid_ki and pid_kd are in units of 1/255 of full power per degC,
degC*s and degC/s, as every printer.cfg of the field has them.
"""

PARAMETER_BASE = 255.0
START_TEMP = 25.0
SETTLED_DELTA = 1.0
SETTLED_SLOPE = 0.1


class ControlPID:
    """PID with a filtered derivative and a clamped integral.

    The integral only moves while the output is not saturated in its
    direction, so that a long climb does not wind it up.
    """

    def __init__(self, heater, config):
        gains = [config.getfloat(name) / PARAMETER_BASE
                 for name in ("pid_kp", "pid_ki", "pid_kd")]
        self.heater = heater
        self.kp, self.ki, self.kd = gains
        self.max_power = heater.get_max_power()
        self.min_deriv_time = heater.get_smooth_time()
        self.max_integral = self.max_power / self.ki if self.ki else 0.0
        self.last_temp = START_TEMP
        self.last_time = 0.0
        self.slope = 0.0
        self.integral = 0.0

    def note_hold(self, duration):
        """print_time stood still for so many s."""
        self.last_time -= duration

    def temperature_update(self, read_time, temp, target_temp):
        """Answer a reading (degC) with a power for the heater."""
        elapsed = read_time - self.last_time
        slope = self._calc_slope(temp, elapsed)
        error = target_temp - temp
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
