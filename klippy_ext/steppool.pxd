# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_steppool cimport steppool


cdef class StepPool:
    cdef steppool *pool
    # Whose pieces are added, to keep them alive
    cdef list syncs
