# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_qmsg cimport qfifo, qsink
from klippy_ext.c_steppersync cimport steppersync


cdef class MessageStore:
    cdef qfifo fifo
    cdef qsink sink


cdef class StepperSync:
    cdef object __weakref__
    cdef steppersync *ss
    cdef readonly object serialqueue
    cdef readonly object command_queue
    cdef readonly int move_count
    cdef list members

    cdef int raise_failure(self, int ret, double gen_time) except -1
