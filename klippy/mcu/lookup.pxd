# SPDX-License-Identifier: GPL-3.0-or-later

cdef class FirmwareLookup:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object _serial
    cdef public str _name
