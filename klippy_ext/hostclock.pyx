# SPDX-License-Identifier: GPL-3.0-or-later
"""The host's clock: real or virtual, for Python and for C."""

from klippy_ext.c_hostclock cimport hostclock_get_real, hostclock_now


cdef class HostClock:
    """What tells the time; subclasses set `clock` before anybody reads it."""

    cpdef double monotonic(self) except? -1.:
        """Present eventtime in seconds; never goes back."""
        if self.clock is NULL:
            raise RuntimeError("this clock has not been started")
        return hostclock_now(self.clock)


cdef class RealClock(HostClock):
    """The machine's own monotonic clock."""

    def __cinit__(self):
        self.clock = hostclock_get_real()
