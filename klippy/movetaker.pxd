# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.lookahead cimport Move


# Plug-ins override these, and may return None
cdef class MoveTaker:
    cpdef check_move(self, Move move, int axis_index)
    cpdef double calc_junction(self, Move prev_move, Move move,
                               int axis_index) except -1.
    cpdef process_move(self, double print_time, Move move, int axis_index)
