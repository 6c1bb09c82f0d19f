# SPDX-License-Identifier: GPL-3.0-or-later
# As compiled_world.py has it: all modules in one flat package
cimport cython

from heat_budget cimport HeatBudget, calc_hold
from heat_probe cimport HeatProbe
from heat_stall cimport StallWatch
from heat_watch cimport HeatWatch
from klippy.units cimport celsius_t, sec_t


@cython.final
cdef class HeatGuard:
    cdef public HeatWatch watch
    cdef public StallWatch stall
    cdef public HeatProbe probe
    cdef public HeatBudget budget
    cdef readonly double offset
    cdef readonly bint is_cut

    cpdef int restart(self) except -1
    cdef int _restart_others(self) except -1
    @cython.locals(code=int, watch=HeatWatch)
    cpdef int update(self, sec_t elapsed, celsius_t temp, celsius_t target, double duty,
                     double fan, double flow) except -1
    @cython.locals(code=int, rate=double, hold=double, above=double, watch=HeatWatch,
                   stall=StallWatch)
    cdef int _ask_others(self, sec_t elapsed, celsius_t temp, celsius_t target,
                         double duty, double flow) except -1
