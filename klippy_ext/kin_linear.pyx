# SPDX-License-Identifier: GPL-3.0-or-later
"""Steppers whose position is a weighted sum of x, y and z."""

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_kin_linear cimport kin_linear, kin_linear_new, kin_linear_set
from klippy_ext.itersolve cimport StepperKinematics


cdef class LinearKinematics(StepperKinematics):
    """Position cx * x + cy * y + cz * z.

    (1, 0, 0) is the x stepper of a cartesian machine, (1, 1, 0) and
    (1, -1, 0) are the two of a corexy.
    """

    def __init__(self, double cx, double cy, double cz):
        if self.its is not NULL:
            raise RuntimeError("kinematics are initialized once")
        self.its = <itersolve *>kin_linear_new(cx, cy, cz)
        self.is_owner = True
        if self.its is NULL:
            raise MemoryError()

    def set_weights(self, double cx, double cy, double cz, double offset=0.):
        """Position cx * x + cy * y + cz * z + offset from now on.

        All steps must be made, and the position must be the same before and
        after for where the machine is: no step is made for the change.
        """
        kin_linear_set(<kin_linear *>self.get(), cx, cy, cz, offset)
