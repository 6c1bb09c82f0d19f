# SPDX-License-Identifier: GPL-3.0-or-later
"""Owner of a stepcompress: one stepper's steps on their way to messages.

Clocks are 64 bit ticks of the stepper's mcu, positions whole steps.
"""

cimport cython
from libc.errno cimport ENOMEM
from libc.stdint cimport int64_t, uint8_t, uint32_t, uint64_t
from libc.stdlib cimport free, malloc

from klippy_ext.c_motionlock cimport motionlock_give, motionlock_take
from klippy_ext.c_qmsg cimport QMSG_DATA_MAX
from klippy_ext.c_stepcompress cimport (
    stepcompress_add_message,
    stepcompress_check,
    stepcompress_configure,
    stepcompress_delete,
    stepcompress_extract,
    stepcompress_find_position,
    stepcompress_get_counts,
    stepcompress_get_last_position,
    stepcompress_new,
    stepcompress_note_made,
    stepcompress_options,
    stepcompress_push,
    stepcompress_reset,
    stepcompress_set_last_position,
    stepcompress_set_time,
    stephistory,
)
from klippy_ext.c_steppool cimport steppool_settle


@cython.no_gc_clear
cdef class StepCompress:
    """Steps of the stepper with this oid."""

    def __cinit__(self, unsigned oid):
        self.oid = oid
        self.sc = stepcompress_new(oid)
        if self.sc is NULL:
            raise MemoryError()

    def __dealloc__(self):
        stepcompress_delete(self.sc)

    def configure(self, uint32_t max_error_ticks, uint32_t queue_step_tag,
                  uint32_t set_dir_tag, invert_dir=False):
        """Set how far a step may be off, and how messages begin.

        The tags are the message numbers of queue_step and set_next_step_dir.
        """
        cdef stepcompress_options options
        options.max_error = max_error_ticks
        options.queue_step_tag = queue_step_tag
        options.set_dir_tag = set_dir_tag
        options.invert_dir = bool(invert_dir)
        self.invert_dir = options.invert_dir
        steppool_settle()
        stepcompress_configure(self.sc, &options)

    def set_time(self, double offset, double freq):
        """From now on clock = (print_time - offset) * freq."""
        steppool_settle()
        stepcompress_set_time(self.sc, offset, freq)

    def reset(self, int64_t clock):
        """The next step's interval counts from clock; direction unknown."""
        motionlock_take()
        ret = stepcompress_reset(self.sc, clock)
        motionlock_give()
        raise_error(ret)

    def push(self, const double[::1] times, int direction):
        """Add steps by hand: print_times, in order; direction +1 or -1."""
        if direction not in (1, -1):
            raise ValueError("direction must be 1 or -1, not %d"
                             % (direction,))
        steppool_settle()
        if times.shape[0]:
            raise_error(stepcompress_push(
                self.sc, &times[0], times.shape[0], direction))

    def note_made(self, double print_time):
        """No step will be added before print_time."""
        steppool_settle()
        stepcompress_note_made(self.sc, print_time)

    def queue_message(self, const uint8_t[::1] data, req_clock=None):
        """Send an encoded command after all steps so far.

        With req_clock it occupies a cell of the move queue until then.
        Raises ValueError unless it has 1 to 59 bytes.
        """
        cdef uint64_t clock = req_clock or 0
        if not 0 < data.shape[0] <= QMSG_DATA_MAX:
            raise ValueError("a command has 1 to %d bytes, not %d"
                             % (QMSG_DATA_MAX, data.shape[0]))
        motionlock_take()
        ret = stepcompress_add_message(self.sc, &data[0], data.shape[0], clock)
        motionlock_give()
        raise_error(ret)

    def set_last_position(self, int64_t clock, int64_t position):
        """All steps so far led to this position, at clock."""
        motionlock_take()
        ret = stepcompress_set_last_position(self.sc, clock, position)
        motionlock_give()
        raise_error(ret)

    def get_last_position(self):
        """Position after all steps so far."""
        motionlock_take()
        position = stepcompress_get_last_position(self.sc)
        motionlock_give()
        return position

    def find_past_position(self, int64_t clock):
        """Position at a clock, as far as the history goes back."""
        motionlock_take()
        position = stepcompress_find_position(self.sc, clock)
        motionlock_give()
        return position

    def extract_old(self, int max, int64_t start_clock, int64_t end_clock):
        """Runs that overlap the span of clocks, newest first, at most max.

        Each is (first_clock, last_clock, start_position, count, interval,
        add); count is negative when the steps go down, 0 for a mark left by
        set_last_position().
        """
        if max <= 0:
            return []
        cdef stephistory *h = <stephistory *>malloc(
            max * sizeof(stephistory))
        if h is NULL:
            raise MemoryError()
        try:
            motionlock_take()
            count = stepcompress_extract(
                self.sc, h, max, start_clock, end_clock)
            motionlock_give()
            return [(h[i].first_clock, h[i].last_clock, h[i].start_position,
                     h[i].count, h[i].interval, h[i].add)
                    for i in range(count)]
        finally:
            free(h)

    def get_counts(self):
        """(steps, runs) that were made into messages so far."""
        cdef uint64_t n_steps, n_runs
        steppool_settle()
        stepcompress_get_counts(self.sc, &n_steps, &n_runs)
        return n_steps, n_runs

    def check(self):
        """Raise AssertionError if an invariant does not hold (for tests)."""
        steppool_settle()
        cdef int ret = stepcompress_check(self.sc)
        if ret:
            raise AssertionError("stepcompress is inconsistent: %d" % (ret,))


cdef int raise_error(int ret) except -1:
    if ret == -ENOMEM:
        raise MemoryError()
    return 0
