# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.gcode cimport LineRunner, ScriptMutex


@cython.final
cdef class SdStream:
    cdef LineRunner runner
    cdef ScriptMutex mutex
    cdef object reader
    cdef bytes block
    cdef long long base
    cdef Py_ssize_t offset
    cdef long long n_lines
    cdef long long counted_from
    cdef long long failed_end
    cdef public long long position
    cdef public long long next_position
    cdef public long long size
    cdef public bint must_stop
    cdef public bint must_break
    cdef public bint is_closed
    cdef bint is_at_end
    cpdef bint run_lines(self) except *
    cdef bint _run_block(self) except *
    cdef bint _read_more(self) except *
