# SPDX-License-Identifier: GPL-3.0-or-later
"""The filament drive, with linear pressure advance."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_extruder cimport (
    kin_extruder,
    kin_extruder_new,
    kin_extruder_set_advance,
)
from klippy_ext.itersolve cimport StepperKinematics


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
                             double smooth_time):
        """Use these for moves that begin at print_time or later.

        advance: s (mm per mm/s).  smooth_time: s.  advance 0 also ends the
        averaging.
        Raises ValueError if one is negative or not finite.
        """
        if kin_extruder_set_advance(
                <kin_extruder *>self.get(), print_time, advance,
                smooth_time):
            raise ValueError(
                "pressure advance and smooth time must not be negative: %r,"
                " %r" % (advance, smooth_time))
