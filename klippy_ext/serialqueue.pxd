# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_qmsg cimport qsink
from klippy_ext.c_serialqueue cimport cmdqueue, serialqueue
from klippy_ext.hostclock cimport HostClock


cdef class CommandQueue:
    cdef SerialQueue owner
    cdef cmdqueue *cq


cdef class SerialQueue:
    cdef object __weakref__
    cdef serialqueue *sq
    cdef HostClock clock
    cdef object link
    cdef object ready_callback
    cdef bint is_virtual
    cdef bint is_file
    cdef readonly bint is_closed
    cdef double bits_a_byte

    cdef cmdqueue *bind(self, CommandQueue cq) except NULL
    cdef qsink *sink(self, CommandQueue cq) except NULL
