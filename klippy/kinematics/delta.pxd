# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.lookahead cimport Move
from klippy.units cimport mm_s2_t, mm_s_t, mm_t


@cython.final
cdef class Tower:
    cdef readonly mm_t x, y
    cdef readonly double arm2, y_share
    # Height of the carriage at its endstop, above that of a head at z = 0
    cdef readonly mm_t top

    cpdef double calc_carriage(self, double x, double y, double z) except? -1.
    @cython.locals(way=double, way_y=double, along=double, across2=double,
                   reach2=double, slope=double, turn=double, dx=double, dy=double)
    cpdef double find_highest(self, Move move) except? -1.
    @cython.locals(start=double)
    cpdef double find_over(self, Move move) except? -1.


cdef class DeltaKinematics:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer
    cdef public list rails, towers
    cdef public mm_s_t max_velocity, max_z_velocity
    cdef public mm_s2_t max_accel, max_z_accel
    cdef readonly bint is_homed
    cdef readonly mm_t radius, min_z, max_z, max_radius
    # No carriage reaches its endstop while the head is below
    cdef readonly mm_t cone_start_z
    # Squares of the radius up to which moves are allowed, and are not slowed
    cdef double max_radius2, slow_radius2, min_arm2
    cdef readonly list home_position

    @cython.locals(reach2=double, other2=double, ratio=double)
    cpdef int check_move(self, Move move) except -1
    @cython.locals(distance=double, ratio=double)
    cdef int slow_down(self, Move move, double reach2) except -1
