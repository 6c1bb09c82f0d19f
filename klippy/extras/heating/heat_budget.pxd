# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.units cimport celsius_t, sec_t

cdef double MOST_NEED, MAX_LACK, LACK_BEGINS, FLOW_SHARE, STRONGER, LATEST, MOST_LOSSES


@cython.final
cdef class HeatBudget:
    # Traits
    cdef double fall, slope_time, margin, room
    cdef sec_t patience
    cdef readonly celsius_t max_temp, hot, open
    cdef readonly double lack
    cdef readonly bint is_cut, is_under
    cdef readonly int n_cuts
    cdef bint is_new
    cdef celsius_t last, peak
    cdef double slope, latest, before
    cdef sec_t cut_time

    cpdef int restart(self) except -1
    cpdef int trust(self, celsius_t temp) except -1
    @cython.locals(change=double, losses=double, share=double, limit=double)
    cpdef int update(self, sec_t elapsed, celsius_t temp, celsius_t target, double duty,
                     double rate, double hold, celsius_t room, double flow) except -1
    @cython.locals(losses=double, limit=double)
    cpdef int watch_ceiling(self, sec_t elapsed, celsius_t temp, celsius_t target,
                            double duty, double rate, double hold, double room,
                            double flow) except -1
    cdef int _follow_fall(self, sec_t elapsed, celsius_t temp) except -1


cpdef double calc_hold(double steepest, double rise, double above) except? -1.
