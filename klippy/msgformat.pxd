# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

cdef int FIELD_SIGNED
cdef int FIELD_UNSIGNED
cdef int FIELD_BYTES


@cython.locals(size=Py_ssize_t, byte=cython.uchar, value=cython.longlong)
cpdef tuple get_int(bytes data, Py_ssize_t pos)
cpdef bytes take_bytes(bytes data, Py_ssize_t pos, Py_ssize_t count)
@cython.locals(shift=int)
cpdef put_int(bytearray out, long long value)


cdef class MessageFormat:
    cdef object __weakref__
    cdef public int msgid
    cdef public str msgformat
    cdef public str name
    cdef public list fields
    cdef public list kinds
    cdef public list codes
    cdef public list enums
    cdef public bint has_enums
    cdef bytearray _header
    @cython.locals(i=Py_ssize_t, out=bytearray, value=bytes)
    cpdef bytes encode(self, object params)
    @cython.locals(i=Py_ssize_t, kind=int)
    cpdef Py_ssize_t decode(self, bytes data, Py_ssize_t pos, dict params) except -1
    cdef _name_values(self, dict params)


cdef class OutputFormat:
    cdef public int msgid
    cdef public str msgformat
    cdef public str name
    cdef public list kinds
    cdef public str text
    cpdef Py_ssize_t decode(self, bytes data, Py_ssize_t pos, dict params) except -1
