# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.units cimport celsius_t, sec_t

cdef double SATURATED, MAX_OFFSET, LEAST_BUMP, MOST_BUMP, BUMP_STEPS, MOST_SHARE
cdef double LIVE, DEAD_SHARE, FIRST_LIVE, LEAST_GAIN, ENOUGH
cdef double FORGET_MEAN, LEAST_MEAN
cdef double ALIVE, DEAD_LIMIT, MOST_RATIO, FORGET, STEP_NOISE
cdef int SAME_READINGS


@cython.final
cdef class HeatProbe:
    # Traits
    cdef sec_t half, delay, idle
    # What is known of heater and sensor: degC/s, b, degC^2, degC
    cdef readonly double rate, gain, noise, step
    cdef double gain_s
    cdef readonly double mean
    cdef int n_means
    cdef long long random
    # The last reading
    cdef celsius_t last
    cdef readonly int n_same
    # This hold
    cdef readonly double offset, ratio
    cdef readonly bint is_asking, is_alive
    cdef readonly int n_periods
    cdef bint is_new
    cdef sec_t wait, time, away
    cdef celsius_t target
    cdef double mean_duty
    # Of the wave and of the reading
    cdef int polarity, shown
    cdef double bump, expected, sum_x, sum_y, first_y

    cpdef int restart(self) except -1
    cpdef int update(self, sec_t elapsed, celsius_t temp, celsius_t target, double duty,
                     double rate) except -1
    @cython.locals(change=double)
    cpdef int hurry(self) except -1
    cdef int _note_step(self, celsius_t temp) except -1
    cdef int _take_rate(self, double rate) except -1
    cdef bint _is_holding(self, celsius_t temp, celsius_t target,
                          double duty) except -1
    @cython.locals(period=double, phase=double, weight=double)
    cdef int _follow(self, sec_t elapsed, celsius_t temp, double duty) except -1
    @cython.locals(period=double, turn=double, is_turn=bint, code=int)
    cdef int _advance(self, sec_t elapsed, celsius_t temp) except -1
    @cython.locals(room=double)
    cdef int _begin_wave(self, sec_t period) except -1
    @cython.locals(phase=double, height=double, sign=int)
    cdef int _set_offset(self, sec_t period) except -1
    @cython.locals(bump=double)
    cdef double _choose_bump(self) except? -1.
    @cython.locals(s=double, m=double, gain=double, live=double, dead=double,
                   noise=double, ratio=double)
    cdef int _judge(self, double shown) except -1
    @cython.locals(weight=double)
    cdef double _note_mean(self, double expected) except? -1.
    @cython.locals(square=double)
    cdef int _note_noise(self, double rest) except -1
    cdef int _decide(self, double s, double m, double noise) except -1
    @cython.locals(mean=double)
    cdef int _learn(self, double s, double m, double noise) except -1
