# SPDX-License-Identifier: GPL-3.0-or-later
"""A [pid_profile] with `control: mpc`: other values for a heater's model."""

from klippy.extras.control_mpc import ControlMPC
from klippy.extras.mpc_options import FilamentTraits, MpcParameters, MpcTuning
from klippy.record import record


@record(frozen=True)
class MpcProfile:
    """What control_mpc works by, but for the sections it looks at.

    fan_name, sensor_name: as the heater has them; None: not told.
    """

    control = "mpc"
    parameters: MpcParameters
    filament: FilamentTraits
    tuning: MpcTuning
    fan_name: str | None = None
    sensor_name: str | None = None

    @classmethod
    def from_config(cls, config):
        return cls(MpcParameters.from_config(config),
                   FilamentTraits.from_config(config), MpcTuning.from_config(config),
                   config.get("cooling_fan", None),
                   config.get("ambient_temp_sensor", None))

    @classmethod
    def from_control(cls, control):
        """The profile that would bring back what a ControlMPC has now."""
        around = control.surroundings
        return cls(control.parameters, control.filament, control.tuning,
                   around.fan_name, around.sensor_name)

    def explain_unfit(self, heater):
        """Why a heater cannot work by this; None when it can."""
        control = heater.control
        if not isinstance(control, ControlMPC):
            return ("'control: mpc' needs 'control: mpc' in section '%s', where a"
                    " profile can be the pid" % (heater.name,))
        around = control.surroundings
        for option, name, own in (
                ("cooling_fan", self.fan_name, around.fan_name),
                ("ambient_temp_sensor", self.sensor_name, around.sensor_name)):
            if name not in (None, own):
                return ("option '%s' must be that of section '%s', '%s'"
                        % (option, heater.name, own or "none"))
        if self.filament.temp_source == "sensor" and around.sensor_name is None:
            return ("filament_temperature_source: sensor needs an ambient_temp_sensor"
                    " in section '%s'" % (heater.name,))
        return None

    def list_options(self):
        """[(option, text)] of the section that from_config() reads."""
        names = (("cooling_fan", self.fan_name),
                 ("ambient_temp_sensor", self.sensor_name))
        return [("control", self.control), *self.parameters.list_options(),
                *self.filament.list_options(), *self.tuning.list_options(),
                *((option, name) for option, name in names if name is not None)]

    def apply(self, control):
        """Let a ControlMPC go on by this from the next reading on."""
        control.filament, control.tuning = self.filament, self.tuning
        control.surroundings.flow.max_retract = self.tuning.max_retract
        control.apply_parameters(self.parameters)
