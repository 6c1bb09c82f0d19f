# SPDX-License-Identifier: GPL-3.0-or-later
"""Owner of a trapq: the queue of planned motion.

Units: mm, mm/s, mm/s^2, s; times are print_time.
"""

cimport cython
from libc.errno cimport ENOMEM
from libc.stdint cimport uint32_t, uintptr_t
from libc.stdlib cimport free, malloc

from klippy_ext.c_motionlock cimport motionlock_give, motionlock_take
from klippy_ext.c_steppool cimport steppool_settle
from klippy_ext.c_trapq cimport (
    trap_move,
    trap_record,
    trapq,
    trapq_add,
    trapq_add_like,
    trapq_check,
    trapq_delete,
    trapq_extract,
    trapq_finalize,
    trapq_mark,
    trapq_new,
    trapq_rewind,
    trapq_set_position,
)


cdef class TrapMove:
    """One straight move or arc: speed up, cruise, slow down.

    accel_t, cruise_t, decel_t: s.  start_x ... : mm.  axes_r_x ... : mm of
    the axis a mm of the move.  start_v, cruise_v: mm/s.  accel: mm/s^2, used
    for both ends.  turn: rad by which the direction turns each mm, 0 for a
    straight line; normal (0, 1, 2): the axis around which it turns, positive
    from x to y, y to z, z to x; axes_r is the direction at the start then.

    On an extruder's queue x is the filament, and axes_r_y is
    not 0 where pressure advance applies.
    """


@cython.no_gc_clear
cdef class TrapQ:
    """Queue of moves, with a history for reports."""

    def __cinit__(self):
        self.origin = None

    def __init__(self):
        if self.tq is not NULL:
            raise RuntimeError("a TrapQ is initialized once")
        self.tq = trapq_new()
        self.is_owner = True
        if self.tq is NULL:
            raise MemoryError()

    def __dealloc__(self):
        if self.is_owner:
            trapq_delete(self.tq)

    @staticmethod
    def from_pointer(address, origin=None):
        """Wrap a trapq that somebody else owns, by its address.

        origin: an object to keep alive with the wrapper.
        Raises ValueError for address 0.
        """
        cdef TrapQ self = TrapQ.__new__(TrapQ)
        self.tq = <trapq *><uintptr_t>address
        self.origin = origin
        if self.tq is NULL:
            raise ValueError("trapq pointer is NULL")
        return self

    cpdef int append(self, double print_time, TrapMove move) except -1:
        """Add a move that begins at print_time.

        Raises ValueError if a value is not finite, a time is negative or the
        normal is no axis.
        """
        cdef trap_move m
        cdef int ret
        copy_move(&m, move)
        motionlock_take()
        ret = trapq_add(self.tq, print_time, &m)
        motionlock_give()
        raise_error(ret)
        return 0

    cpdef int append_like(
            self, double print_time, TrapMove move, TrapMove like) except -1:
        """Add a move, cut at the times at which `like` (an arc) is cut.

        Both take the same time.  Raises ValueError as append() does.
        """
        cdef trap_move m, other
        cdef int ret
        copy_move(&m, move)
        copy_move(&other, like)
        motionlock_take()
        ret = trapq_add_like(self.tq, print_time, &m, &other)
        motionlock_give()
        raise_error(ret)
        return 0

    def set_position(self, double print_time, double x, double y, double z):
        """From print_time on the position is this.

        What was planned for later is dropped; a mark is left in the history.
        Raises ValueError if a value is not finite.
        """
        cdef double[3] pos = [x, y, z]
        motionlock_take()
        ret = trapq_set_position(self.tq, print_time, pos)
        motionlock_give()
        raise_error(ret)

    def mark(self):
        """Allow that what is appended from here on is taken back."""
        steppool_settle()
        trapq_mark(self.tq)

    def rewind(self):
        """Take back what was appended behind the mark; no steps are made of it."""
        steppool_settle()
        trapq_rewind(self.tq)

    def finalize(self, double print_time, double clear_history_time):
        """Steps up to print_time are made; forget older history."""
        motionlock_take()
        trapq_finalize(self.tq, print_time, clear_history_time)
        motionlock_give()

    def extract_old(self, int max, double start_time, double end_time):
        """Moves that overlap the span of time, newest first, at most max.

        Each is (print_time, move_t, start_v, accel, start_x, y, z, x_r, y_r,
        z_r).  An arc is told as chords, no more than 0.005 mm off.
        """
        if max <= 0:
            return []
        cdef trap_record *r = <trap_record *>malloc(max * sizeof(trap_record))
        if r is NULL:
            raise MemoryError()
        try:
            motionlock_take()
            count = trapq_extract(self.tq, r, max, start_time, end_time)
            motionlock_give()
            return [(r[i].print_time, r[i].move_t, r[i].start_v, r[i].accel,
                     r[i].start[0], r[i].start[1], r[i].start[2],
                     r[i].axes_r[0], r[i].axes_r[1], r[i].axes_r[2])
                    for i in range(count)]
        finally:
            free(r)

    def check(self):
        """Raise AssertionError if an invariant does not hold (for tests)."""
        steppool_settle()
        cdef int ret = trapq_check(self.tq)
        if ret:
            raise AssertionError("trapq is inconsistent: %d" % (ret,))


cdef void copy_move(trap_move *m, TrapMove move) noexcept:
    m.accel_t = move.accel_t
    m.cruise_t = move.cruise_t
    m.decel_t = move.decel_t
    m.start[0] = move.start_x
    m.start[1] = move.start_y
    m.start[2] = move.start_z
    m.axes_r[0] = move.axes_r_x
    m.axes_r[1] = move.axes_r_y
    m.axes_r[2] = move.axes_r_z
    m.start_v = move.start_v
    m.cruise_v = move.cruise_v
    m.accel = move.accel
    m.turn = move.turn
    m.normal = <uint32_t>move.normal


cdef int raise_error(int ret) except -1:
    if ret == -ENOMEM:
        raise MemoryError()
    if ret:
        raise ValueError("a move's values must be finite, its times not"
                         " negative and its normal 0, 1 or 2")
    return 0
