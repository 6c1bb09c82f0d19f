# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.shaper cimport ShapedPath
from klippy_ext.stepcompress cimport StepCompress
from klippy_ext.trapq cimport TrapQ


cdef class StepperKinematics:
    cdef object __weakref__
    cdef itersolve *its
    cdef bint is_owner
    cdef readonly TrapQ trapq
    cdef readonly StepCompress stepcompress
    cdef readonly object origin
    cdef readonly ShapedPath shaper

    cdef itersolve *get(self) except NULL


cdef int raise_error(int ret, double print_time) except -1
