# SPDX-License-Identifier: GPL-3.0-or-later

cdef class SerialReader:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object reactor
    cdef public object msgparser
    cdef public object serialqueue
    cdef dict _handlers
