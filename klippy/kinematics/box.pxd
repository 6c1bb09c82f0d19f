# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.kinematics.limits cimport MoveLimits
from klippy.lookahead cimport Move


cdef class BoxMachine:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer
    cdef public list rails
    cdef public MoveLimits limits

    cpdef int check_move(self, Move move) except -1
