# SPDX-License-Identifier: GPL-3.0-or-later
"""Owner of a steppool: threads that make steps beside the main thread."""

from klippy_ext.c_steppool cimport (
    steppool_check,
    steppool_delete,
    steppool_finish,
    steppool_new,
    steppool_start,
)


cdef class StepPool:
    """Makes the steps that StepperSync.start() asks for.

    n_threads: besides the main one; with 0 all is done in finish().  What is
    made does not depend on it.
    """

    def __cinit__(self, int n_threads=0):
        if n_threads < 0:
            raise ValueError("a pool has 0 threads or more, not %d" % (n_threads,))
        self.syncs = []
        self.pool = steppool_new(n_threads)
        if self.pool is NULL:
            raise MemoryError()

    def __dealloc__(self):
        with nogil:
            steppool_delete(self.pool)

    def start(self):
        """Begin what was asked for, and return at once."""
        with nogil:
            steppool_start(self.pool)

    def finish(self):
        """Lend a hand until all is made.  StepperSync.finish() tells errors."""
        with nogil:
            steppool_finish(self.pool)
        self.syncs.clear()

    def check(self):
        """Raises AssertionError if the counts of the pool do not fit together."""
        cdef int ret
        with nogil:
            ret = steppool_check(self.pool)
        if ret:
            raise AssertionError("the pool of step threads is inconsistent")
