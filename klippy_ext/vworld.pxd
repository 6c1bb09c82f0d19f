# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_vworld cimport vedgelog, vlink, vmcu, voutput, vstep, vworld
from klippy_ext.hostclock cimport HostClock


cdef class VirtualWorld(HostClock):
    cdef object __weakref__
    cdef vworld *world
    cdef list mcus
    cdef list tickers
    cdef list queues
    cdef list devices
    cdef bint is_running
    cdef object failure

    cdef vworld *check_idle(self) except NULL


cdef class VirtualLink:
    cdef readonly VirtualWorld world
    cdef vlink *link


cdef class VirtualMcu:
    cdef readonly VirtualWorld world
    cdef readonly str name
    cdef readonly VirtualLink link
    cdef vmcu *mcu
    cdef list spi_devices
    cdef dict i2c_devices

    cdef bytes exchange_spi(self, int bus, bytes data)
    cdef bytes exchange_i2c(self, int bus, int address, bytes written, int read_len)
    cdef int attach_buses(self) except -1
    cdef int check_pin(self, int pin) except -1


cdef class StepTrace:
    cdef VirtualMcu owner
    cdef vstep *step


cdef class OutputTrace:
    cdef VirtualMcu owner
    cdef voutput *output


cdef class EdgeTrace:
    cdef VirtualMcu owner
    cdef vedgelog *log
