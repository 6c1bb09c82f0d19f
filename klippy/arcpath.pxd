# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.units cimport mm_t


@cython.final
cdef class ArcPath:
    # The axis at right angles to the plane, and those of the plane
    cdef readonly int normal, axis_a, axis_b
    cdef readonly mm_t center_a, center_b, radius
    # Angle at the start and how far it goes on; rad, positive from a to b
    cdef readonly double angle, sweep
    cdef readonly mm_t length
    cdef readonly double turn, curvature
    # Share of the way that lies in the plane
    cdef double flat
    cdef mm_t[3] first
    cdef mm_t[3] last

    @cython.locals(angle=double)
    cdef double find_direction_along(self, double share, double rx, double ry,
                                     double rz) noexcept
