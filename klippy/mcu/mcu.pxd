# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.clocksync cimport ClockSync
from klippy.mcu.lookup cimport FirmwareLookup


cdef class MCU(FirmwareLookup):
    cdef public object _printer, _reactor
    cdef public ClockSync _clocksync
    # Ticks a s
    cdef public double _mcu_freq
    cdef public list _post_init_callbacks, _movequeue_callbacks
    # Changes of outputs that came too late for their time
    cdef public int late_outputs
    cdef public bint _is_configured, is_non_critical, non_critical_disconnected
