# SPDX-License-Identifier: GPL-3.0-or-later

cdef class MCU_digital_out:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object _mcu, part, _set_cmd, _oid
    cdef public int _start_value, _shutdown_value, _invert
    # Clock of the newest change, ticks
    cdef public object _last_clock
