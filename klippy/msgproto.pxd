# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython


cdef class MessageParser:
    cdef dict __dict__
    cdef object __weakref__
    cdef public str warn_prefix
    cdef public dict messages_by_name
    cdef public dict messages_by_format
    cdef public dict messages_by_id
    @cython.locals(start=Py_ssize_t)
    cpdef Py_ssize_t decode_message(self, bytes data, Py_ssize_t pos,
                                    dict params) except -1
    @cython.locals(pos=Py_ssize_t, size=Py_ssize_t, params=dict, result=list)
    cpdef list parse_payload(self, bytes data)
