# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython


@cython.final
cdef class ClockFit:
    cdef public double nominal_freq, freq, start_time, start_clock
    cdef public double mean_time, mean_residual
    cdef public double weight, variance, covariance, prior
    cdef public double min_rtt, jitter, error
    cdef public long count
    @cython.locals(rtt=double, extra=double, base=double, weight=double, time=double,
                   distance=double)
    cpdef double add(self, double sent_time, double receive_time,
                     double clock) except? -1
    @cython.locals(keep=double, residual=double, share=double, delta=double,
                   total=double)
    cdef int _update(self, double elapsed, double clock, double weight) except -1
    @cython.locals(elapsed=double)
    cpdef double clock_at(self, double time) except? -1
    @cython.locals(anchor=double)
    cpdef double time_at(self, double clock) except? -1
