# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.itersolve cimport StepperKinematics


cdef class WinchKinematics(StepperKinematics):
    pass


cdef class RadiusKinematics(StepperKinematics):
    pass
