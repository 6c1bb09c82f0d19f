# SPDX-License-Identifier: GPL-3.0-or-later
"""How a [temperature_fan] chooses its speed: watermark, pid or curve."""
import bisect
import statistics
from collections import deque
from itertools import pairwise

START_TEMP = 25.0


class ControlBangBang:
    """Fan on above target + max_delta, off below target - max_delta.

    reverse: the fan brings heat, so the other way round.
    """

    def __init__(self, owner, config):
        self.owner = owner
        self.delta = config.getfloat("max_delta", 2.0, above=0.0)
        self.is_reverse = config.getboolean("reverse", False)
        self.is_on = False

    def calc_speed(self, read_time, temp, target):
        """Speed 0..1 for a reading."""
        if temp >= target + self.delta:
            self.is_on = not self.is_reverse
        elif temp <= target - self.delta:
            self.is_on = self.is_reverse
        return self.owner.max_speed if self.is_on else 0.0


class ControlPID:
    """PID of the cooling: more speed the further above the target."""

    def __init__(self, owner, config):
        self.owner = owner
        self.kp, self.ki, self.kd = [
            config.getfloat(name) / 255.0
            for name in ("pid_kp", "pid_ki", "pid_kd")]
        self.deriv_time = config.getfloat("pid_deriv_time", 2.0, above=0.0)
        self.sign = -1.0 if config.getboolean("reverse", False) else 1.0
        limit = config.getfloat("pid_integral_max", owner.max_speed, minval=0.0)
        self.max_integral = limit / self.ki if self.ki else 0.0
        self.last_temp, self.last_time = START_TEMP, 0.0
        self.slope = self.integral = 0.0

    def calc_speed(self, read_time, temp, target):
        """Speed 0..1 for a reading."""
        elapsed = read_time - self.last_time
        weight = min(elapsed / self.deriv_time, 1.0)
        rate = (temp - self.last_temp) / max(elapsed, 1e-6)
        self.slope += (rate - self.slope) * weight
        error = self.sign * (temp - target)
        integral = min(max(self.integral + error * elapsed, 0.0), self.max_integral)
        wanted = (self.kp * error + self.ki * integral
                  + self.sign * self.kd * self.slope)
        speed = min(max(wanted, 0.0), self.owner.max_speed)
        if speed == wanted:
            self.integral = integral
        self.last_temp, self.last_time = temp, read_time
        return max(speed, self.owner.min_speed)


class ControlCurve:
    """Speeds at temperatures, straight lines between them, full speed at the target.

    The hystereses are degC that the temperature must go back by before it counts:
    cooling_hysteresis when it falls, heating_hysteresis when it rises.
    """

    def __init__(self, owner, config):
        self.owner = owner
        points = config.getlists("points", seps=(",", "\n"), parser=float, count=2)
        try:
            self.set_points(points, owner.target_temp)
        except ValueError as err:
            raise config.error("Option 'points' in section '%s': %s"
                               % (config.get_name(), err)) from err
        count = config.getint("smooth_readings", 10, minval=0)
        self.readings = deque(maxlen=max(count, 1))
        self.cooling = config.getfloat("cooling_hysteresis", 0.0, minval=0.0)
        self.heating = config.getfloat("heating_hysteresis", 0.0, minval=0.0)
        self.held = None

    def set_points(self, points, target):
        """Another curve from the next reading on, which may come on another thread.

        points: (degC, speed).  Raises ValueError if they make no curve that ends
        at the target (degC).
        """
        points = sorted(points)
        end = (target, self.owner.max_speed)
        for (temp, speed), (next_temp, next_speed) in pairwise([*points, end]):
            if temp >= next_temp or not 0.0 <= speed <= next_speed:
                raise ValueError(
                    "temperatures must differ and lie below target_temp, speeds must"
                    " not fall and end at max_speed: not so from %s, %s to %s, %s"
                    % (temp, speed, next_temp, next_speed))
        self.points = points

    def set_smoothing(self, count, cooling, heating):
        """Median of so many readings; hystereses (degC)."""
        if max(count, 1) != self.readings.maxlen:
            self.readings = deque(self.readings, maxlen=max(count, 1))
        self.cooling, self.heating = cooling, heating

    def calc_speed(self, read_time, temp, target):
        """Speed 0..1 for a reading."""
        self.readings.append(temp)
        median = statistics.median(self.readings)
        if self.held is None:
            self.held = median
        self.held = min(max(self.held, median - self.heating), median + self.cooling)
        points = [point for point in self.points if point[0] < target]
        return interpolate([*points, (target, self.owner.max_speed)], self.held)


def interpolate(points, temp):
    """Speed on the line through (degC, speed) points; beyond it that of its ends."""
    index = bisect.bisect_right(points, (temp, 2.0))
    if index == 0:
        return points[0][1] if len(points) > 1 else 0.0
    if index == len(points):
        return points[-1][1]
    (t0, s0), (t1, s1) = points[index - 1], points[index]
    return s0 + (s1 - s0) * (temp - t0) / (t1 - t0)


KINDS = {"watermark": ControlBangBang, "pid": ControlPID, "curve": ControlCurve}
