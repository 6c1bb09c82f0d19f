# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_hostclock cimport hostclock


cdef class HostClock:
    cdef hostclock *clock

    cpdef double monotonic(self) except? -1.


cdef class RealClock(HostClock):
    pass
