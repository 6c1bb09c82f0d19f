# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.kinematics.box cimport BoxMachine
from klippy.lookahead cimport Move
from klippy.units cimport mm_t


@cython.final
cdef class Span:
    cdef readonly mm_t way, nearest, farthest
    cdef readonly double foot

    @cython.locals(x=double, y=double, half=double, half2=double)
    cpdef list find_crossings(self, Move move, double radius)


cdef class PolarKinematics(BoxMachine):
    cdef public object toolhead, bed, arm, rail_z
    cdef readonly mm_t min_radius, max_radius
    # rad/s
    cdef public double max_angular_velocity
    cdef bint is_homing

    @cython.locals(span=Span, free=double, radius=double)
    cpdef int check_move(self, Move move) except -1
