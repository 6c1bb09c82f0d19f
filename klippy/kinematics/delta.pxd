# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.kinematics.arms cimport ArmsMachine
from klippy.lookahead cimport Move
from klippy.units cimport mm_s2_t, mm_t


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


cdef class DeltaKinematics(ArmsMachine):
    cdef public list towers
    cdef public mm_s2_t max_z_accel
    cdef readonly mm_t radius
    # No carriage reaches its endstop while the head is below
    cdef readonly mm_t cone_start_z
    # Square of the radius up to which moves are not slowed
    cdef double slow_radius2, min_arm2

    @cython.locals(reach2=double, other2=double, ratio=double)
    cpdef int check_move(self, Move move) except -1
    @cython.locals(distance=double, ratio=double)
    cdef int slow_down(self, Move move, double reach2) except -1
