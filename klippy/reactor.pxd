# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.timerheap cimport Timer, TimerHeap
from klippy.units cimport sec_t


@cython.final
cdef class ReactorCompletion:
    cdef object __weakref__
    cdef Reactor _reactor
    cdef object _result
    cdef bint _is_done
    cdef list _waiting
    cpdef bint test(self) except -1
    @cython.locals(waiting=list, timer=Timer)
    cpdef complete(self, object result)


@cython.final
cdef class ReactorMutex:
    cdef object __weakref__
    cdef Reactor _reactor
    cdef bint _is_locked
    cdef object _waiting
    cpdef bint test(self) except -1
    @cython.locals(entry=list)
    cpdef lock(self)
    @cython.locals(entry=list)
    cpdef unlock(self)


@cython.final
cdef class FileHandler:
    cdef public int fd
    cdef public object read_callback
    cdef public object write_callback
    cdef public int events


@cython.final
cdef class FileEvent:
    cdef readonly object callback


cdef class Reactor:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object clock
    cdef public bint is_virtual
    cdef public object monotonic
    cdef object _waiter
    cdef TimerHeap _heap
    cdef object _async_calls
    cdef object _thread
    cdef object _hub
    cdef object _current
    cdef object _outside
    cdef list _idle_workers
    cdef set _workers
    cdef bint _is_running
    cdef bint _is_finalized
    cdef object _error_handler
    cdef object _error
    cdef sec_t _now
    cdef readonly long long n_switches
    cdef readonly object slow
    cpdef update_timer(self, Timer timer, sec_t waketime)
    cdef int _arm(self, Timer timer, sec_t waketime) except -1
    cpdef unregister_timer(self, Timer timer)
    cpdef Timer get_wake_timer(self)
    cpdef pause(self, sec_t waketime)
    @cython.locals(heap=TimerHeap, timer=Timer, now=sec_t, _=Py_ssize_t)
    cdef _dispatch_until(self, Timer end_timer)
    cdef _take_async_calls(self)
    cdef int _run_timer(self, Timer timer) except -1
    cdef _run_file_events(self, FileHandler handler, int events)
    cdef int _start(self, object job) except -1
    @cython.locals(start=double, busy=double)
    cdef int _switch_to(self, object worker) except -1
    @cython.locals(timer=Timer, waketime=sec_t)
    cdef int _run_job(self, object job) except -1
    cdef _handle_error(self, object err)
