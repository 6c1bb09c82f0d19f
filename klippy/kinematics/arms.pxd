# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.lookahead cimport Move
from klippy.units cimport mm_s2_t, mm_s_t, mm_t


cdef class ArmsMachine:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer
    cdef public list rails
    cdef public mm_s_t max_velocity, max_z_velocity
    cdef public mm_s2_t max_accel
    cdef readonly bint is_homed
    cdef readonly mm_t min_z, max_z, max_radius
    cdef double max_radius2
    cdef readonly list home_position

    cdef bint is_inside(self, Move move)
