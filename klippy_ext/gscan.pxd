# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_gscan cimport gscan


cdef class MoveScan:
    cdef gscan found
    cdef readonly bint matched
    cdef readonly unsigned mask
    cdef readonly double x
    cdef readonly double y
    cdef readonly double z
    cdef readonly double e
    cdef readonly double f
    cdef bint _scan(self, const char *text, Py_ssize_t size) noexcept
    cpdef bint scan(self, str line) except *
    cpdef Py_ssize_t next_line(self, bytes block, Py_ssize_t pos) except -2
