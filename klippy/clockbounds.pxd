# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython


@cython.final
cdef class Stretch:
    cdef readonly double start, sent, upper, received, lower
    cdef readonly long count
    cdef int note(self, double sent, double upper, double received, double lower,
                  double freq) except -1


@cython.final
cdef class ClockBounds:
    cdef readonly list stretches
    cdef public long count
    @cython.locals(upper=double, lower=double, stretches=list, last=Stretch)
    cpdef int add(self, double sent, double received, double ahead, double freq,
                  double length) except -1
    cpdef double get_start(self) except? -1
    @cython.locals(stretches=list)
    cpdef int forget(self, double time) except -1
