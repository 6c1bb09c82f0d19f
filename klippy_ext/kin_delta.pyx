# SPDX-License-Identifier: GPL-3.0-or-later
"""The carriage of one tower of a linear delta printer."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_delta cimport kin_delta_new
from klippy_ext.itersolve cimport StepperKinematics


cdef class DeltaKinematics(StepperKinematics):
    """Position z + sqrt(arm2 - (tower_x - x)^2 - (tower_y - y)^2).

    arm2: square of the arm's length (mm^2).  tower_x, tower_y: mm.
    """

    def __init__(self, double arm2, double tower_x, double tower_y):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_delta_new(arm2, tower_x, tower_y)
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()
