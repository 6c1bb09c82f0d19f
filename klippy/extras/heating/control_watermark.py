# SPDX-License-Identifier: GPL-3.0-or-later
"""On/off temperature control with a dead band of +-max_delta."""

DEFAULT_DELTA = 2.0


class ControlBangBang:
    """Full power until above target + delta, none until below - delta."""

    def __init__(self, heater, config):
        self._setup(heater, config.getfloat("max_delta", DEFAULT_DELTA, above=0.0))

    @classmethod
    def from_delta(cls, heater, delta):
        """A control with a dead band of +-delta degC."""
        control = cls.__new__(cls)
        control._setup(heater, delta)
        return control

    def _setup(self, heater, delta):
        self.heater = heater
        self.max_power = heater.get_max_power()
        self.delta = delta
        self.is_on = False

    def begin(self, read_time, temp):
        """There was a reading before this control: nothing depends on it here."""

    def note_hold(self, duration):
        """print_time stood still: nothing depends on it here."""

    def temperature_update(self, read_time, temp, target_temp):
        """Answer a reading (degC) with a power for the heater."""
        if not target_temp or temp >= target_temp + self.delta:
            self.is_on = False
        elif temp <= target_temp - self.delta:
            self.is_on = True
        self.heater.set_pwm(read_time, self.max_power if self.is_on else 0.0)

    def check_busy(self, eventtime, smoothed_temp, target_temp):
        """True while the heater still has to warm up."""
        return smoothed_temp < target_temp - self.delta
