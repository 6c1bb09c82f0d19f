# SPDX-License-Identifier: GPL-3.0-or-later

cdef class MCU_endstop:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object _mcu, _home_cmd, _query_cmd, _dispatch
