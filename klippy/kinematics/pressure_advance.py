# SPDX-License-Identifier: GPL-3.0-or-later
"""What a filament drive does about the pressure in the nozzle.

See docs/motion_features.md for the models, klippy_ext/csrc/kin_extruder.h for
how they become positions.
"""

from klippy import dangers
from klippy.record import record
from klippy_ext.kin_extruder import MODELS

MAX_TIME_OFFSET = 0.200
# Of the option and the parameter; the values are those of the drive
MODEL_NAMES = {**{name: name for name in MODELS}, "reciprocal": "recipr"}


@record(frozen=True)
class PressureAdvance:
    """How the drive leads the filament.

    advance: s (mm a mm/s).  smooth_time: s, over which it is averaged.  model:
    "linear", "tanh" or "recipr"; with the last two up to offset mm are added, at
    about velocity mm/s.  time_offset: s by which the drive is ahead.
    """
    advance: float = 0.
    smooth_time: float = 0.040
    model: str = "linear"
    offset: float = 0.
    velocity: float = 0.
    time_offset: float = 0.

    @classmethod
    def from_config(cls, config):
        """Read the options of a section.  Raises ConfigError."""
        model = config.getchoice("pressure_advance_model", MODEL_NAMES, "linear")
        advance = config.getfloat("pressure_advance", 0., minval=0.)
        # Any move is led by what was set when it came
        config.getboolean("per_move_pressure_advance", False)
        most = dangers.get(config.get_printer())
        smooth_time = config.getfloat(
            "pressure_advance_smooth_time", cls.smooth_time, above=0.,
            maxval=most.override_pressure_advance_smooth_time_max)
        time_offset = config.getfloat(
            "pressure_advance_time_offset", 0., minval=-MAX_TIME_OFFSET,
            maxval=MAX_TIME_OFFSET)
        offset = velocity = 0.
        if model != "linear":
            advance = config.getfloat("linear_advance", advance, minval=0.)
            offset = config.getfloat("nonlinear_offset", 0., minval=0.)
            if offset:
                velocity = config.getfloat("linearization_velocity", above=0.)
            else:
                velocity = config.getfloat("linearization_velocity", 0., minval=0.)
        return cls(advance, smooth_time, model, offset, velocity, time_offset)

    def change(self, gcmd, max_smooth_time):
        """This with the parameters of SET_PRESSURE_ADVANCE."""
        model = gcmd.get("MODEL", self.model).lower()
        if model not in MODEL_NAMES:
            raise gcmd.error("MODEL=%s of '%s' is not one of %s" % (
                model, gcmd.get_commandline(), ", ".join(sorted(MODEL_NAMES))))
        changed = PressureAdvance(
            gcmd.get_float("ADVANCE", self.advance, minval=0.),
            gcmd.get_float("SMOOTH_TIME", self.smooth_time, minval=0.,
                           maxval=max_smooth_time),
            MODEL_NAMES[model], gcmd.get_float("OFFSET", self.offset, minval=0.),
            gcmd.get_float("VELOCITY", self.velocity, minval=0.),
            gcmd.get_float("TIME_OFFSET", self.time_offset, minval=-MAX_TIME_OFFSET,
                           maxval=MAX_TIME_OFFSET))
        if changed.is_curved() and not changed.velocity:
            raise gcmd.error("'%s' needs VELOCITY=, above 0: the speed (mm/s) at which"
                             " OFFSET makes itself felt" % (gcmd.get_commandline(),))
        return changed

    def is_curved(self):
        """Whether there is a part that is not proportional to the speed."""
        return self.model != "linear" and self.offset > 0.

    def get_reach(self):
        """s of motion, at most, that a position depends on to either side."""
        is_averaged = self.advance or self.is_curved()
        return abs(self.time_offset) + (.5 * self.smooth_time if is_averaged else 0.)

    def apply(self, drive, print_time):
        """Have the kinematics of a drive do so from print_time on."""
        curve = {}
        if self.is_curved():
            curve = {"model": self.model, "offset": self.offset,
                     "velocity": self.velocity}
        drive.set_pressure_advance(print_time, self.advance, self.smooth_time,
                                   time_offset=self.time_offset, **curve)

    def describe(self):
        """Lines for the user; the usual two if there is nothing else."""
        lines = ["pressure_advance: %.6f" % (self.advance,),
                 "pressure_advance_smooth_time: %.6f" % (self.smooth_time,)]
        if self.is_curved():
            lines += ["pressure_advance_model: " + self.model,
                      "nonlinear_offset: %.6f" % (self.offset,),
                      "linearization_velocity: %.6f" % (self.velocity,)]
        if self.time_offset:
            lines.append("pressure_advance_time_offset: %.6f" % (self.time_offset,))
        return "\n".join(lines)

    def get_status(self):
        """Fields of the status of an extruder or extruder_stepper."""
        return {"pressure_advance": self.advance, "smooth_time": self.smooth_time,
                "pressure_advance_model": self.model,
                "nonlinear_offset": self.offset,
                "linearization_velocity": self.velocity,
                "time_offset": self.time_offset}
