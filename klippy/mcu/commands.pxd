# SPDX-License-Identifier: GPL-3.0-or-later

cdef class CommandWrapper:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object _serial, _command, _queue


cdef class AsyncCommandWrapper(CommandWrapper):
    pass


cdef class CommandQueryWrapper:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object _mcu, _serial, _command, _response_name, _oid, _queue
