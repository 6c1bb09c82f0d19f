# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.kinematics.arms cimport ArmsMachine
from klippy.lookahead cimport Move
from klippy.units cimport mm_t


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


cdef class RotaryDeltaMachine(ArmsMachine):
    cdef public list arms

    cpdef int check_move(self, Move move) except -1
    cdef int slow_down(self, Move move, double ratio) except -1
    @cython.locals(arm=Arm, ratio=double)
    cpdef double find_ratio(self, double x, double y, double z) except -1.
    @cython.locals(arm=Arm)
    cdef int _check_arms(self, Move move) except -1
