# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.lookahead cimport Move
from klippy.movetaker cimport MoveTaker
from klippy.units cimport mm_s2_t, mm_s_t, mm_t
from klippy_ext.trapq cimport TrapMove, TrapQ


cdef class PrinterExtruder(MoveTaker):
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer, heater, extruder_stepper
    cdef public str name
    cdef public TrapQ trapq
    cdef public mm_t nozzle_diameter
    cdef public double filament_area, max_extrude_ratio
    cdef public mm_s_t max_e_velocity, instant_corner_v
    cdef public mm_s2_t max_e_accel
    cdef public mm_t max_e_dist
    # Where the newest move on the trapq ends
    cdef public mm_t last_position
    cdef TrapMove segment

    cpdef check_move(self, Move move, int axis_index)
    cpdef double calc_junction(self, Move prev_move, Move move,
                               int axis_index) except -1.
    cpdef process_move(self, double print_time, Move move, int axis_index)
