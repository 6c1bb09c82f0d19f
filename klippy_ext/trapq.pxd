# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_trapq cimport trapq


cdef class TrapMove:
    cdef public double accel_t
    cdef public double cruise_t
    cdef public double decel_t
    cdef public double start_x
    cdef public double start_y
    cdef public double start_z
    cdef public double axes_r_x
    cdef public double axes_r_y
    cdef public double axes_r_z
    cdef public double start_v
    cdef public double cruise_v
    cdef public double accel
    cdef public double turn
    cdef public int normal


cdef class TrapQ:
    cdef object __weakref__
    cdef trapq *tq
    cdef bint is_owner
    cdef readonly object origin

    cpdef int append(self, double print_time, TrapMove move) except -1
    cpdef int append_like(
        self, double print_time, TrapMove move, TrapMove like) except -1
