# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.itersolve cimport StepperKinematics
from klippy_ext.trapq cimport TrapQ


cdef class ExtruderKinematics(StepperKinematics):
    cdef readonly TrapQ head
