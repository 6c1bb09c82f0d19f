# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.units cimport celsius_t, sec_t

@cython.locals(area=double)
cpdef double calc_filament_transfer(double speed, double diameter, double density,
                                    double heat_capacity) except? -1.
@cython.locals(place=double, index=Py_ssize_t, upper=double)
cpdef double interpolate_transfer(table, double speed) except? -1.


@cython.final
cdef class ThermalModel:
    # W, J/K, 1/s, W/K
    cdef readonly double power, capacity, responsiveness, transfer
    cdef readonly double extra_transfer, filament_transfer
    cdef readonly celsius_t filament_temp
    cdef public celsius_t block, sensor, ambient

    cpdef set_parameters(self, double power, double capacity, double responsiveness,
                         double transfer)
    cpdef int reset(self, celsius_t temp, celsius_t ambient) except -1
    cpdef int set_losses(self, double extra_transfer, double filament_transfer,
                         celsius_t filament_temp) except -1
    cpdef double calc_loss(self, celsius_t temp) except? -1.
    cpdef double calc_filament_loss(self, celsius_t temp) except? -1.
    @cython.locals(loss=double, drive=double, rate=double)
    cpdef int predict(self, sec_t elapsed, double duty) except -1
    @cython.locals(lag_rate=double, offset=double, decay=double, share=double,
                   own=double)
    cdef int _follow_decay(self, sec_t elapsed, celsius_t final, double rate) except -1
    @cython.locals(lag=double, own=double)
    cdef int _follow_line(self, sec_t elapsed, double slope) except -1
    cpdef int correct(self, celsius_t sensor_change, celsius_t block_change,
                      celsius_t ambient_change) except -1
