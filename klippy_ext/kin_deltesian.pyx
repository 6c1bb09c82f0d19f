# SPDX-License-Identifier: GPL-3.0-or-later
"""The carriages of a deltesian."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_deltesian cimport kin_deltesian_new
from klippy_ext.itersolve cimport StepperKinematics


cdef class DeltesianKinematics(StepperKinematics):
    """Position z + sqrt(arm2 - (tower_x - x)^2).

    arm2: square of the arm's length (mm^2).  tower_x: mm.
    """

    def __init__(self, double arm2, double tower_x):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_deltesian_new(arm2, tower_x)
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()
