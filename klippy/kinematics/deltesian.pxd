# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.kinematics.box cimport BoxMachine
from klippy.kinematics.delta cimport Tower
from klippy.lookahead cimport Move
from klippy.units cimport mm_s2_t, mm_s_t, mm_t


cdef class DeltesianMachine(BoxMachine):
    cdef public list columns
    cdef public mm_s_t max_velocity
    cdef public mm_s2_t max_accel
    # How much faster than the head a carriage may be at full speed
    cdef public double slow_ratio
    cdef readonly mm_t home_x, home_z

    cpdef int check_move(self, Move move) except -1
    cdef int slow_down(self, Move move, double ratio) except -1
    @cython.locals(ratio=double, off=double, column=Tower)
    cpdef double find_ratio(self, double x) except -1.
    @cython.locals(column=Tower, over=double)
    cdef int _check_carriages(self, Move move) except -1
