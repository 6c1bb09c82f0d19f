# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.units cimport celsius_t, sec_t

cdef double SATURATED, SUPPLY, LOSSES, FAN_LOSSES, LEAST_SHARE, CALM, WARM_AIR
cdef double NEW_STRETCH, LEAST_CHANGE, MUST_FALL, LEAST_HELD


@cython.final
cdef class StallWatch:
    cdef double lag, window, fast, slow, climb_limit, fall_limit
    cdef double mean_duty, held
    cdef celsius_t held_temp
    cdef sec_t rest
    cdef readonly double steepest, climb_sum, fall_sum
    cdef sec_t full_time, off_time, window_time
    cdef double slope
    cdef celsius_t steepest_temp, slope_temp, window_temp
    cdef bint is_new
    cdef int slope_fan

    cpdef int restart(self) except -1
    @cython.locals(share=double)
    cpdef int update(self, sec_t elapsed, celsius_t temp, double change, double duty,
                     double above, int fan, double flow,
                     double hold) except -1
    @cython.locals(share=double)
    cpdef double find_rise(self, celsius_t temp) except? -1.
    @cython.locals(losses=double, worse=double, least=double)
    cdef int _watch_climb(self, sec_t elapsed, celsius_t temp, double change, int fan,
                          double flow) except -1
    cdef int _take_slope(self, double slope, celsius_t temp, int fan) except -1
    cdef bint _has_stayed(self, sec_t elapsed, celsius_t temp) except -1
    @cython.locals(least=double)
    cdef int _watch_fall(self, sec_t elapsed, double change, double above) except -1
