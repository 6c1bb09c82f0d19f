# SPDX-License-Identifier: GPL-3.0-or-later

cdef class ClockSync:
    cdef dict __dict__
    cdef object __weakref__
    cdef public double mcu_freq, hold
    cdef public object last_clock
    cdef public tuple clock_est
    cdef public int pending_count


cdef class SecondarySync(ClockSync):
    cdef public tuple clock_adj
    cdef public double last_sync_time
    cdef public bint is_absent
