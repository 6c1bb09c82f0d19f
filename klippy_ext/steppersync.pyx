# SPDX-License-Identifier: GPL-3.0-or-later
"""Owner of a steppersync: all steppers of one mcu and its move queue."""

cimport cython
from libc.errno cimport ENOMEM
from libc.stdint cimport uint64_t

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_qmsg cimport (
    qfifo,
    qfifo_clear,
    qfifo_join,
    qfifo_pop,
    qmsg_free,
    qsink,
)
from klippy_ext.c_steppersync cimport (
    steppersync_add,
    steppersync_check,
    steppersync_delete,
    steppersync_finish,
    steppersync_flush,
    steppersync_generate,
    steppersync_get_failed,
    steppersync_new,
    steppersync_set_kinematics,
    steppersync_set_time,
    steppersync_start,
)
from klippy_ext.c_steppool cimport steppool_settle
from klippy_ext.itersolve cimport StepperKinematics, raise_error
from klippy_ext.serialqueue cimport CommandQueue, SerialQueue
from klippy_ext.stepcompress cimport StepCompress
from klippy_ext.steppool cimport StepPool


@cython.no_gc_clear
cdef class MessageStore:
    """Takes messages instead of a serial queue: for tests and reports."""

    def __cinit__(self):
        self.sink.ctx = &self.fifo
        self.sink.send_batch = store_batch

    def __dealloc__(self):
        qfifo_clear(&self.fifo)

    def take(self):
        """All messages since the last call: [(data, min_clock, req_clock)]."""
        result = []
        while True:
            m = qfifo_pop(&self.fifo)
            if m is NULL:
                return result
            result.append((<bytes>m.data[:m.len], m.min_clock, m.req_clock))
            qmsg_free(m)


# noexcept: called from C, and nothing here can fail.
cdef void store_batch(void *ctx, qfifo *batch) noexcept nogil:
    qfifo_join(<qfifo *>ctx, batch)


@cython.no_gc_clear
cdef class StepperSync:
    """Steppers of one mcu.

    serialqueue: a SerialQueue, or a MessageStore.  move_count: cells of the
    mcu's move queue.  Messages go to a command queue of their own.
    """

    def __cinit__(self, serialqueue, int move_count):
        cdef qsink *sink
        if move_count < 1:
            raise ValueError("a move queue has 1 cell or more, not %d"
                             % (move_count,))
        self.serialqueue = serialqueue
        self.move_count = move_count
        self.members = []
        if isinstance(serialqueue, MessageStore):
            sink = &(<MessageStore>serialqueue).sink
        else:
            self.command_queue = serialqueue.alloc_command_queue()
            sink = (<SerialQueue?>serialqueue).sink(
                <CommandQueue>self.command_queue)
        self.ss = steppersync_new(sink, move_count)
        if self.ss is NULL:
            raise MemoryError()

    def __dealloc__(self):
        steppersync_delete(self.ss)

    def add(self, StepCompress stepcompress not None,
            StepperKinematics kinematics=None):
        """Take part: a stepper, or (without kinematics) another emitter."""
        cdef itersolve *its = NULL
        steppool_settle()
        if kinematics is not None:
            its = kinematics.get()
        if steppersync_add(self.ss, stepcompress.sc, its) < 0:
            raise MemoryError()
        self.members.append((stepcompress, kinematics))

    def set_kinematics(self, StepCompress stepcompress not None,
                       StepperKinematics kinematics=None):
        """Let a stepper that was added move by these from now on."""
        cdef itersolve *its = NULL
        steppool_settle()
        if kinematics is not None:
            its = kinematics.get()
        for number, (member, _) in enumerate(self.members):
            if member is stepcompress:
                steppersync_set_kinematics(self.ss, number, its)
                self.members[number] = (stepcompress, kinematics)
                return
        raise ValueError("the stepper with oid %d was not added"
                         % (stepcompress.oid,))

    def set_time(self, double offset, double freq):
        """For all steppers: clock = (print_time - offset) * freq."""
        steppersync_set_time(self.ss, offset, freq)

    def generate(self, double gen_time):
        """Make the steps of all steppers up to gen_time (print_time).

        Runs without the GIL; nobody else may touch the steppers meanwhile.
        Raises ValueError if a stepper's position jumps.
        """
        cdef int ret
        with nogil:
            ret = steppersync_generate(self.ss, gen_time)
        if ret:
            self.raise_failure(ret, gen_time)

    def start(self, StepPool pool not None, double gen_time, uint64_t clock):
        """Ask a pool for what generate(gen_time), flush(clock) will need.

        Nothing else may be done with this object before finish().
        """
        if steppersync_start(self.ss, pool.pool, gen_time, clock):
            raise MemoryError()
        pool.syncs.append(self)

    def finish(self, double gen_time):
        """All steps that start() asked for are made.

        Raises what generate() would.
        """
        cdef int ret
        with nogil:
            ret = steppersync_finish(self.ss)
        if ret:
            self.raise_failure(ret, gen_time)

    cdef int raise_failure(self, int ret, double gen_time) except -1:
        cdef StepCompress member = self.members[
            steppersync_get_failed(self.ss)][0]
        try:
            raise_error(ret, gen_time)
        except ValueError as error:
            raise ValueError("stepper with oid %d: %s"
                             % (member.oid, error)) from None
        return 0

    def flush(self, uint64_t clock, uint64_t clear_history_clock=0):
        """Send all messages that are needed before clock.

        Steps up to it must have been made.  Older history is forgotten.
        """
        cdef int ret
        with nogil:
            ret = steppersync_flush(self.ss, clock, clear_history_clock)
        if ret == -ENOMEM:
            raise MemoryError()

    def check(self):
        """Raise AssertionError if an invariant does not hold (for tests)."""
        steppool_settle()
        cdef int ret = steppersync_check(self.ss)
        if ret:
            raise AssertionError("steppersync is inconsistent: %d" % (ret,))
