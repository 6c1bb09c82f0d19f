# SPDX-License-Identifier: GPL-3.0-or-later
"""Steppers that set a distance from a point or from the z axis."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_winch cimport kin_winch_new, kin_winch_new_radius
from klippy_ext.itersolve cimport StepperKinematics


cdef class WinchKinematics(StepperKinematics):
    """Position: length of a cable from the anchor at x, y, z (mm)."""

    def __init__(self, double x, double y, double z):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_winch_new(x, y, z)
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()


cdef class RadiusKinematics(StepperKinematics):
    """Position: distance of the head from the z axis (mm)."""

    def __init__(self):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_winch_new_radius()
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()
