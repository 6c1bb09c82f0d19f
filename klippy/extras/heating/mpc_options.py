# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of `control: mpc`."""

from klippy.record import record

FILAMENT_SOURCES = ("ambient", "sensor")


def parse_filament_temp(text):
    """'ambient', 'sensor' or a number of degC; ValueError if it is neither."""
    word = text.strip().lower()
    return word if word in FILAMENT_SOURCES else float(word)


def calc_fan_share(transfers):
    """What fan speeds add to the first, which is that of the fan when off.

    Calibrations write all that is lost at each speed, people also what is added.
    """
    return tuple(max(value - transfers[0], 0.0) for value in transfers)


def parse_transfers(text):
    """What fan speeds add, W/K, from numbers none of which is below 0;
    ValueError if it is something else."""
    values = tuple(float(word) for word in text.split(",") if word.strip())
    if any(not value >= 0.0 for value in values):
        raise ValueError("below 0")
    return calc_fan_share(values)


@record
class MpcParameters:
    """What is measured by MPC_CALIBRATE; None: not yet.

    capacity: J/K.  responsiveness: 1/s.  transfer: W/K without a fan;
    fan_transfers: W/K on top at fan speeds evenly spaced from 0 to 1.
    """

    capacity: float | None
    responsiveness: float | None
    transfer: float | None
    fan_transfers: tuple = ()

    @classmethod
    def from_config(cls, config):
        fan_transfers = tuple(config.getfloatlist("fan_ambient_transfer", []))
        if any(value < 0.0 for value in fan_transfers):
            raise config.error(
                "Option 'fan_ambient_transfer' in section '%s' has a value below 0"
                % (config.get_name(),))
        return cls(
            config.getfloat("block_heat_capacity", None, above=0.0),
            config.getfloat("sensor_responsiveness", None, above=0.0),
            config.getfloat("ambient_transfer", None, minval=0.0),
            calc_fan_share(fan_transfers))

    def list_missing(self):
        """Options without a value."""
        values = (("block_heat_capacity", self.capacity),
                  ("sensor_responsiveness", self.responsiveness),
                  ("ambient_transfer", self.transfer))
        return [name for name, value in values if value is None]

    def list_options(self):
        """[(option, text)] that from_config() reads, of what is known."""
        values = (("block_heat_capacity", self.capacity),
                  ("sensor_responsiveness", self.responsiveness),
                  ("ambient_transfer", self.transfer))
        options = [(name, "%.6g" % (value,)) for name, value in values
                   if value is not None]
        if self.fan_transfers:
            options.append(("fan_ambient_transfer", ", ".join(
                "%.6g" % ((self.transfer or 0.0) + share,)
                for share in self.fan_transfers)))
        return options


@record
class FilamentTraits:
    """mm, g/cm^3, J/g/K, and where its temperature comes from."""

    diameter: float
    density: float
    heat_capacity: float
    temp_source: str | float

    @classmethod
    def from_config(cls, config):
        return cls(
            config.getfloat("filament_diameter", 1.75, above=0.0),
            config.getfloat("filament_density", 1.2, above=0.0),
            config.getfloat("filament_heat_capacity", 1.8, above=0.0),
            cls._read_source(config))

    def list_options(self):
        """[(option, text)] that from_config() reads."""
        source = self.temp_source
        return [("filament_diameter", "%.6g" % (self.diameter,)),
                ("filament_density", "%.6g" % (self.density,)),
                ("filament_heat_capacity", "%.6g" % (self.heat_capacity,)),
                ("filament_temperature_source",
                 source if isinstance(source, str) else "%.6g" % (source,))]

    @staticmethod
    def _read_source(config):
        text = config.get("filament_temperature_source", "ambient")
        try:
            return parse_filament_temp(text)
        except ValueError as e:
            raise config.error(
                "Option 'filament_temperature_source' in section '%s' must be"
                " ambient, sensor or degrees, not '%s'"
                % (config.get_name(), text)) from e


@record(frozen=True)
class MpcTuning:
    """How the control behaves: W, s, share a second, K/s, K/s, mm."""

    power: float
    target_reach_time: float
    smoothing: float
    min_ambient_change: float
    steady_state_rate: float
    max_retract: float

    @classmethod
    def from_config(cls, config):
        return cls(
            config.getfloat("heater_power", above=0.0),
            config.getfloat("target_reach_time", 2.0, above=0.0),
            config.getfloat("smoothing", 0.83, above=0.0, maxval=1.0),
            config.getfloat("min_ambient_change", 1.0, above=0.0),
            config.getfloat("steady_state_rate", 0.5, above=0.0),
            config.getfloat("maximum_retract", 2.0, above=0.0))

    def list_options(self):
        """[(option, text)] that from_config() reads."""
        values = (("heater_power", self.power),
                  ("target_reach_time", self.target_reach_time),
                  ("smoothing", self.smoothing),
                  ("min_ambient_change", self.min_ambient_change),
                  ("steady_state_rate", self.steady_state_rate),
                  ("maximum_retract", self.max_retract))
        return [(name, "%.6g" % (value,)) for name, value in values]
