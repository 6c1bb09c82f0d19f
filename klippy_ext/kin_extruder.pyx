# SPDX-License-Identifier: GPL-3.0-or-later
"""The filament drive, with pressure advance."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_extruder cimport (
    ADVANCE_LINEAR,
    ADVANCE_RECIPROCAL,
    ADVANCE_TANH,
    advance_kind,
    advance_model,
    kin_extruder,
    kin_extruder_new,
    kin_extruder_set_model,
    kin_extruder_set_shaper,
)
from klippy_ext.itersolve cimport StepperKinematics
from klippy_ext.shaper cimport ShapedPath
from klippy_ext.trapq cimport TrapQ

# How the lead of a velocity goes beyond what is proportional to it
MODELS = {"linear": ADVANCE_LINEAR, "tanh": ADVANCE_TANH,
          "recipr": ADVANCE_RECIPROCAL}


cdef class ExtruderKinematics(StepperKinematics):
    """Position x of its queue, led by pressure advance.

    Moves with axes_r_y not 0 are led by advance * velocity, and all is
    averaged over smooth_time with a weight that is greatest in the middle.
    """

    def __init__(self):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_extruder_new()
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()

    def set_pressure_advance(self, double print_time, double advance,
                             double smooth_time, model="linear",
                             double offset=0.0, double velocity=0.0,
                             double time_offset=0.0):
        """Use these for moves that begin at print_time or later.

        advance: s (mm per mm/s).  smooth_time: s.  model: one of MODELS; with
        the curved ones offset (mm) * tanh(v / velocity), or offset * (1 -
        1 / (1 + v / velocity)), is added.  time_offset: s by which the drive is
        ahead.  Without any lead there is no averaging either.
        Raises ValueError if one is negative (time_offset may be) or not
        finite, or an offset has no velocity.
        """
        cdef advance_model m
        m.kind = <advance_kind><int>MODELS[model]
        m.linear, m.offset, m.velocity = advance, offset, velocity
        m.smooth_time, m.time_offset = smooth_time, time_offset
        if kin_extruder_set_model(<kin_extruder *>self.get(), print_time, &m):
            raise ValueError(
                "pressure advance and smooth time must not be negative: %r, %r,"
                " and an offset needs a velocity: %r, %r"
                % (advance, smooth_time, offset, velocity))

    def set_shaper(self, ShapedPath shaper, TrapQ head=None):
        """Have the filament of each axis averaged as the axis is.

        shaper: that of x, y and z (any number of drives may use it), or None.
        head: the queue of their moves.  All steps must be made, and all must
        rest as far as the old and the new averages look around that time.
        """
        if shaper is not None and head is None:
            raise ValueError("a shaped drive needs the moves of x, y and z")
        kin_extruder_set_shaper(
            <kin_extruder *>self.get(),
            shaper.path if shaper is not None else NULL,
            head.tq if shaper is not None else NULL)
        self.head = head if shaper is not None else None

    def get_shaper_window(self):
        """(pre, post): s that shaping adds to what is looked at."""
        cdef kin_extruder *k = <kin_extruder *>self.get()
        return k.plan.pre, k.plan.post
