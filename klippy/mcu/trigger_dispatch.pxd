# SPDX-License-Identifier: GPL-3.0-or-later

cdef class TriggerDispatch:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object _mcu, _completion
    cdef public list _trsyncs
    cdef public bint _is_started
