# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_shaper cimport shaper_axis, shaper_path


cdef class ShapedPath:
    cdef shaper_path *path
    cdef readonly bint is_used

    cdef set_axis(self, int axis, shaper_axis *shaper)
