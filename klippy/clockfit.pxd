# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.clockbounds cimport ClockBounds, Stretch


@cython.final
cdef class GridMean:
    cdef readonly double best, total, upper, lower, gain, gain2, drift, drift2
    @cython.locals(weight=double)
    cpdef int add(self, double likely, double upper, double lower, double gain,
                  double drift) except -1
    cpdef int finish(self) except -1
    cdef int _scale(self, double factor) except -1


@cython.final
cdef class ClockFit:
    cdef public double nominal_freq, start_time, start_clock
    cdef public double mean_time, spread, ahead, gain, drift, width
    cdef public double gain_error, drift_error, jitter_to, jitter_from
    cdef public double min_rtt, error, fit_time
    cdef public long count
    cdef readonly ClockBounds bounds
    cpdef double get_jitter(self) except? -1
    cpdef double get_window(self) except? -1
    cpdef double get_interval(self) except? -1
    @cython.locals(elapsed=double, gain=double, clock=double)
    cpdef tuple line_at(self, double time)
    @cython.locals(elapsed=double)
    cpdef double clock_at(self, double time) except? -1
    @cython.locals(later=double)
    cdef double _ahead_at(self, double elapsed) except? -1
    @cython.locals(sent=double, received=double, read=double, rtt=double,
                   middle=double, distance=double)
    cpdef double add(self, double sent_time, double receive_time,
                     double clock) except? -1
    @cython.locals(share=double, bounds=ClockBounds, start=double, limit=double)
    cdef int _note_delays(self, double sent, double to, double back) except -1
    @cython.locals(gain_width=double, drift_width=double)
    cdef int _fit(self) except -1
    @cython.locals(total=double, moment=double, mean=double, spread=double, s=Stretch)
    cdef int _center(self) except -1
    @cython.locals(grid=GridMean, weight_to=double, weight_from=double,
                   drift_step=double, drift=double, gain_step=double, gain=double,
                   upper=double, lower=double, likely=double, i=int, j=int)
    cdef GridMean _weigh(self, double gain_width, double drift_width)
    @cython.locals(upper=double, lower=double, later=double, s=Stretch)
    cdef (double, double) _enclose(self, double gain, double drift) except *
    cdef int _take(self, GridMean grid, double gain_width,
                   double drift_width) except -1
