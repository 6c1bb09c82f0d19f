# SPDX-License-Identifier: GPL-3.0-or-later
# As compiled_world.py has it: all modules in one flat package
cimport cython

from heat_probe cimport HeatProbe
from heat_stall cimport StallWatch
from heat_watch cimport HeatWatch
from klippy.units cimport celsius_t, sec_t


@cython.final
cdef class HeatGuard:
    cdef public HeatWatch watch
    cdef public StallWatch stall
    cdef public HeatProbe probe
    cdef readonly double offset

    cpdef int restart(self) except -1
    @cython.locals(code=int, rate=double, watch=HeatWatch)
    cpdef int update(self, sec_t elapsed, celsius_t temp, celsius_t target, double duty,
                     double fan, double flow) except -1
