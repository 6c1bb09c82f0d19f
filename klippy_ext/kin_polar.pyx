# SPDX-License-Identifier: GPL-3.0-or-later
"""The turning bed of a polar machine."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_polar cimport KIN_POLAR_CORE, kin_polar_new
from klippy_ext.itersolve cimport StepperKinematics

CORE = KIN_POLAR_CORE


cdef class PolarBedKinematics(StepperKinematics):
    """Position: angle of the head about the z axis (radians), over turns.

    Within CORE mm of the axis it follows a simpler path; see kin_polar.h.
    """

    def __init__(self):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_polar_new()
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()
