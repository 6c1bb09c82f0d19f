# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_stepguard cimport stepguard
from klippy_ext.hostclock cimport HostClock
from klippy_ext.vworld cimport VirtualWorld


cdef class StepGuard:
    cdef object __weakref__
    cdef stepguard *guard
    cdef HostClock clock
    cdef VirtualWorld world
    cdef int alarm
    cdef list syncs
    cdef bint is_started
