# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_stepcompress cimport stepcompress


cdef class StepCompress:
    cdef object __weakref__
    cdef stepcompress *sc
    cdef readonly unsigned oid
    cdef readonly bint invert_dir
