# SPDX-License-Identifier: GPL-3.0-or-later
"""[pid_profile <heater> <name>]: a control that PID_PROFILE loads into a heater."""

from klippy.extras.control_pid import OPTIONS, ControlPID
from klippy.extras.control_watermark import DEFAULT_DELTA, ControlBangBang
from klippy.extras.mpc_profile import MpcProfile
from klippy.record import record

PID_VERSION = 1
# Kinds that SET_VALUES can make, and those of sections
KINDS = ("pid", "watermark")
SECTION_KINDS = (*KINDS, "mpc")


@record(frozen=True)
class Profile:
    """One profile.

    control: "pid" or "watermark".  gains: (kp, ki, kd) as in a printer.cfg.
    smooth_time: s, None for the heater's.  target, tolerance: what the gains
    were found with, only kept.  max_delta: degC, of watermark.
    """

    control: str = "pid"
    gains: tuple = (0.0, 0.0, 0.0)
    smooth_time: float | None = None
    target: float | None = None
    tolerance: float | None = None
    max_delta: float = DEFAULT_DELTA

    @classmethod
    def from_config(cls, config):
        """Profile, or MpcProfile for `control: mpc`."""
        version = config.getint("pid_version", PID_VERSION)
        if version != PID_VERSION:
            raise config.error(
                "Option 'pid_version' in section '%s' is %d: this version reads %d,"
                " calibrate anew" % (config.get_name(), version, PID_VERSION))
        control = config.getchoice(
            "control", {kind: kind for kind in SECTION_KINDS}, "pid")
        if control == "mpc":
            return MpcProfile.from_config(config)
        if control == "watermark":
            return cls(control, max_delta=config.getfloat(
                "max_delta", DEFAULT_DELTA, above=0.0))
        return cls(
            control,
            tuple(config.getfloat(option, minval=0.0) for option in OPTIONS),
            config.getfloat("smooth_time", None, above=0.0),
            config.getfloat("pid_target", None),
            config.getfloat("pid_tolerance", None, minval=0.0))

    def list_options(self):
        """[(option, text)] of the section that from_config() reads."""
        options = [("control", self.control)]
        if self.control == "watermark":
            return [*options, ("max_delta", "%.3f" % self.max_delta)]
        options += [(option, "%.3f" % gain)
                    for option, gain in zip(OPTIONS, self.gains, strict=True)]
        more = (("smooth_time", self.smooth_time), ("pid_target", self.target),
                ("pid_tolerance", self.tolerance))
        return options + [(option, "%.3f" % value) for option, value in more
                          if value is not None]

    def make_control(self, heater):
        """A new control of a heater, as after a start."""
        if self.control == "watermark":
            return ControlBangBang.from_delta(heater, self.max_delta)
        return ControlPID.from_gains(heater, self.gains, self.smooth_time)


def load_config_prefix(config):
    parts = config.get_name().split()
    if len(parts) != 3:
        raise config.error(
            "Section '%s' must be named [pid_profile <heater> <name>], without more"
            " spaces" % config.get_name())
    profiles = config.get_printer().load_object(config, "pid_profiles")
    profiles.add_profile(parts[1], parts[2], Profile.from_config(config), config)
    return profiles
