# SPDX-License-Identifier: GPL-3.0-or-later
"""The arms of a rotary delta."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_rotary_delta cimport kin_rotary_delta_new
from klippy_ext.itersolve cimport StepperKinematics


cdef class RotaryDeltaKinematics(StepperKinematics):
    """Position: angle of the upper arm (radians), 0 level and outwards.

    direction: where the arm points, radians from x; all else mm.
    """

    def __init__(self, double shoulder_radius, double shoulder_height,
                 double direction, double upper, double lower):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_rotary_delta_new(
            shoulder_radius, shoulder_height, direction, upper, lower)
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()
