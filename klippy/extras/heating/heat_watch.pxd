# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.units cimport celsius_t, sec_t


cdef int N_FANS, N_REFERENCE
cdef double RATE_BELOW, RATE_ABOVE, RATE_SHARE, RISEN_SHARE
cdef double HOLD_LOW, HOLD_HIGH, FAN_HIGH
cdef double WARM_AIR, ROOM_RISE, ROOM_FALL, FIRST_ROOM, MAX_ROOM
cdef double SURE_TO_RISE, SATURATED, CLIMB_WINDOW, MAX_SWING, MAX_WINDOWS, REST_GAIN
cdef double MIN_ABOVE_ROOM, MAX_EXCESS, EXCESS_STEP, EXCESS_SWING, MAX_STORED
cdef double LEAST_SHARE, SHARE_LOSS, MAX_OFFSET
cdef double REFERENCE_LOW, REFERENCE_HIGH, LEAST_WEIGHT
cdef double JUMP, MAX_JUMPS, JUMP_TIME, MAX_GAP


@cython.locals(i=int, found=double)
cdef double choose(double[::1] values, int index, double spread) except? -1.


@cython.final
cdef class HeatWatch:
    # Traits
    cdef double lag, hold_time, least_climb, drift, limit, limit_time, least_rate
    cdef double most_rate
    # What is known: a (degC/s), g (1/K) for each fan range, the room
    cdef readonly double rate, rate_low, rate_high, share
    cdef public double risen
    cdef double[::1] holds, references
    cdef long[::1] n_holds
    cdef readonly celsius_t room
    # Readings
    cdef celsius_t before, last
    cdef readonly celsius_t temp
    cdef readonly double n_jumps, change
    cdef readonly int fan_range
    cdef bint is_first
    cdef readonly bint is_fresh
    cdef int n_fresh
    # Extremes of the duty
    cdef double duty_low, duty_high, old_low, old_high
    cdef sec_t half_time
    # degC
    cdef readonly double warm_sum, cold_sum, still_sum
    # needs of windows
    cdef readonly double excess
    # What is being learned
    cdef bint has_anchor
    cdef celsius_t anchor_temp
    cdef double heat, above, steepest, steep_above, climb_time, climb_start
    cdef int hold_index
    cdef double hold_left, hold_span, hold_heat, hold_above, hold_offset, hold_flow
    cdef celsius_t hold_start, hold_min, hold_max

    cpdef int restart(self) except -1
    @cython.locals(change=double, index=int)
    cpdef int update(self, sec_t elapsed, celsius_t temp, celsius_t target, double duty,
                     double fan, double flow) except -1
    @cython.locals(low=double, high=double, middle=double, change=double)
    cdef double _filter(self, celsius_t temp, sec_t elapsed) except? -1.
    cdef int _note_duty(self, double duty, sec_t elapsed) except -1
    @cython.locals(found=double, hold=double, i=int)
    cdef double _find_hold(self, int index, bint is_high) except? -1.
    cpdef double choose_hold(self, int index) except? -1.
    cpdef double find_reference(self, int index) except? -1.
    @cython.locals(low=double, high=double, above=double, most=double, least=double,
                   fastest=double, slowest=double, drift=double)
    cdef int _sum_up(self, double change, sec_t elapsed, int index,
                     double flow) except -1
    cdef int _watch_answer(self, double change, sec_t elapsed, double low) except -1
    @cython.locals(limit=double)
    cdef int _judge(self) except -1
    @cython.locals(limit=double, low=double, high=double, is_holding=bint)
    cdef int _learn(self, double elapsed, double target, double duty,
                    int index, double flow) except -1
    cdef int _end_window(self, int index, double target, bint is_off) except -1
    cdef int _begin_window(self, int index, bint is_holding) except -1
    @cython.locals(gain=double, stored=double, is_across=bint)
    cdef int _take_window(self, int index, double target, bint is_off) except -1
    @cython.locals(need=double, swing=double, excess=double)
    cdef int _note_excess(self, int index, double heat) except -1
    @cython.locals(known=double, reference=double, n=int)
    cdef int _take_hold(self, int index, double hold) except -1
    @cython.locals(slope=double)
    cdef int _note_climb(self, double elapsed, double low) except -1
    @cython.locals(gain=double, is_done=bint, least=double)
    cdef int _take_rate(self, int index) except -1
    @cython.locals(share=double, rate=double)
    cdef bint _take_climb(self, double gain, double heat, double lost) except -1
    @cython.locals(doubt=double)
    cdef int _set_rate(self, double rate, double share) except -1
    cdef int _set_anchor(self) except -1
