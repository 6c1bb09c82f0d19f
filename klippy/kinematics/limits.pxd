# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.lookahead cimport Move
from klippy.units cimport mm_s2_t, mm_s_t, mm_t


cdef class MoveLimits:
    cdef public mm_s_t max_z_velocity
    cdef public mm_s2_t max_z_accel
    # What may be used now (nothing of an axis that is not homed), and at most
    cdef mm_t[3] low
    cdef mm_t[3] high
    cdef mm_t[3] full_low
    cdef mm_t[3] full_high

    cdef bint is_inside(self, Move move)
    @cython.locals(ratio=double)
    cpdef int check_move(self, Move move) except -1
