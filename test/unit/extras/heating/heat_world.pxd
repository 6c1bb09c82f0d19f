# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from heat_guard cimport HeatGuard


cdef double PERIOD, FILAMENT_HEAT, MISSED, NEAR
cdef int N_SUBSTEPS, N_NOISE, PID, WATERMARK, MODEL
cdef int HEALTHY, OPEN_HEATER, STUCK_ON, STUCK_SENSOR, STUCK_BELOW, FALLEN_OFF
cdef int SLOW_SENSOR, JUMPING, SHIFTED_UP, SHIFTED_DOWN, DRIFTING, CREEPING
cdef int CORRODING
cdef double THERMISTOR, ZERO


cdef class Kind:
    cdef public double power, capacity, loss, fan, lag, element_lag, low, high
    cdef public double max_temp, tolerance
    cdef public bint is_hotend


cdef class HeaterWorld:
    cdef public object rng
    cdef public HeatGuard guard
    cdef public Kind kind
    cdef double[::1] noise
    cdef public int noise_at, fault, control
    cdef public bint is_script, is_printing, is_hotend, has_plate
    cdef public double now, power, loss, fan_loss, base_ambient, ambient, highest, lag
    cdef public double element_capacity, capacity, contact, noise_level, step
    cdef public double spike_time, next_spike, next_plate, warming, warm_time, warmth
    cdef public double plate, plate_capacity, plate_contact
    cdef public double draft_time, max_flow, kp, ki, kd, feed
    cdef public double element, block, sensor, power_factor, draft, fan, flow, target
    cdef public double duty, next_duty, integral, slope, last, reading
    cdef public double fault_time, frozen, shift, hottest, creep_time
    cdef public double withheld, worst_cut, cut_for, spoiled
    cdef public double next_fan, next_flow, next_supply, next_target, next_phase

    cdef int _plan(self) except -1
    cdef int _move_plate(self) except -1
    cdef double _draw_spike(self) except? -1.
    cdef double _get_noise(self) except? -99.
    @cython.locals(share=double)
    cdef int _stir(self) except -1
    @cython.locals(duty=double, watts=double, losses=double, dt=double, seen=double,
                   lag=double, across=double, down=double, air=double, share=double)
    cdef int _heat(self) except -1
    @cython.locals(temp=double, since=double, fault=int, ohms=double)
    cdef int _read(self) except -1
    @cython.locals(target=double)
    cdef int _keep_account(self) except -1
    cpdef int set_fault(self, int fault) except -1
    @cython.locals(temp=double, target=double, weight=double, error=double,
                   wanted=double, base=double)
    cdef int _control(self) except -1
    @cython.locals(end=double, acted=double, target=double, fan=double, code=int,
                   guard=HeatGuard)
    cpdef int run(self, double seconds) except -1
