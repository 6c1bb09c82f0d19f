# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.units cimport sec_t

cdef bint _is_before(Timer a, Timer b) noexcept


@cython.final
cdef class Timer:
    cdef public object callback
    cdef public object owner
    cdef public sec_t waketime
    cdef readonly long long order
    cdef readonly Py_ssize_t index
    cdef public bint is_registered


@cython.final
cdef class TimerHeap:
    cdef list items
    cdef long long n_armed
    @cython.locals(index=Py_ssize_t)
    cpdef int set(self, Timer timer, sec_t waketime) except -1
    @cython.locals(last=Timer, index=Py_ssize_t)
    cpdef int remove(self, Timer timer) except -1
    cpdef Timer first(self)
    @cython.locals(timers=list, timer=Timer)
    cpdef list clear(self)
    @cython.locals(items=list, moving=Timer, parent=Timer, parent_index=Py_ssize_t)
    cdef Py_ssize_t _sift_up(self, Py_ssize_t index) except -1
    @cython.locals(items=list, moving=Timer, child=Timer, other=Timer,
                   n_items=Py_ssize_t, child_index=Py_ssize_t)
    cdef Py_ssize_t _sift_down(self, Py_ssize_t index) except -1
