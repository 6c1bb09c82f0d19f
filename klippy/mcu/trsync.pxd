# SPDX-License-Identifier: GPL-3.0-or-later

cdef class MCU_trsync:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object _mcu, _trdispatch, _member, _completion
    cdef public list _steppers
