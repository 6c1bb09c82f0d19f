# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.lookahead cimport Move
from klippy.units cimport mm_s2_t, mm_s_t, mm_t


@cython.final
cdef class Arm:
    cdef readonly double direction, cosine, sine
    cdef readonly mm_t radius, height, upper, lower
    # The elbow at the endstop
    cdef readonly mm_t top_x, top_y, top_z

    @cython.locals(out=double, aside=double, down=double, reach=double,
                   seen2=double, seen=double, cosine=double)
    cpdef double find_ratio(self, double x, double y, double z) except -1.
    @cython.locals(x=double, y=double, z=double, along=double, share=double,
                   start=double)
    cpdef double find_over(self, Move move) except? -1.


cdef class RotaryDeltaMachine:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer
    cdef public list rails, arms
    cdef public mm_s_t max_velocity, max_z_velocity
    cdef public mm_s2_t max_accel
    cdef readonly bint is_homed
    cdef readonly mm_t min_z, max_z, max_radius
    cdef double max_radius2
    cdef readonly list home_position

    @cython.locals(reach2=double)
    cpdef int check_move(self, Move move) except -1
    cdef int slow_down(self, Move move, double ratio) except -1
    @cython.locals(arm=Arm, ratio=double)
    cpdef double find_ratio(self, double x, double y, double z) except -1.
    @cython.locals(arm=Arm)
    cdef int _check_arms(self, Move move) except -1
