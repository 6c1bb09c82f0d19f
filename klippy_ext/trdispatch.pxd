# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_trdispatch cimport trdispatch, trmember


cdef class TrDispatch:
    cdef object __weakref__
    cdef readonly object clock
    cdef trdispatch *td
    cdef bint is_owner
    cdef list members


cdef class TrMember:
    cdef object serialqueue
    cdef object command_queue
    cdef trmember *member
