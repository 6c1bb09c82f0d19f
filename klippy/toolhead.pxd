# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.lookahead cimport LookAheadQueue, MotionLimits, Move
from klippy.movetaker cimport MoveTaker
from klippy.units cimport mm_t, sec_t
from klippy_ext.trapq cimport TrapQ


cdef class ToolHead:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer, reactor, mcu, kin, extruder, motion_queuing
    # The extruder if it is of this class
    cdef MoveTaker taker
    cdef public TrapQ trapq
    cdef public LookAheadQueue lookahead
    cdef public MotionLimits limits
    cdef public list extra_axes
    # Where the newest move ends
    cdef mm_t x, y, z, e
    cdef list extra_pos
    # Until when motion is planned for good
    cdef public sec_t print_time
    # Beyond it a G-code command waits
    cdef sec_t pause_time
    # The plan ends at rest: the next move need not follow at once
    cdef public bint is_drained
    cdef public bint can_pause
    cdef public int print_stall
    cdef public bint is_stopped

    @cython.locals(move=Move)
    cpdef int move_xyze(self, double x, double y, double z, double e,
                        double speed) except -1
    @cython.locals(prev=Move, extra_v2=double)
    cdef int add_move(self, Move move) except -1
    cdef bint has_taker(self) noexcept
    cpdef double find_extra_v2(self, Move prev, Move move) except -1.
    cdef int commit(self, bint is_final) except -1
    @cython.locals(move=Move)
    cpdef double append_moves(self, double time, list moves) except -1.
    cdef int append_extra(self, double print_time, Move move) except -1
