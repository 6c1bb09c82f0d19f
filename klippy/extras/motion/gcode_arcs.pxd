# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython


@cython.final
cdef class Arc:
    # Axes of the plane, and the one at right angles to it
    cdef readonly int axis_a, axis_b, axis_c
    # From the centre to the start, and the centre; mm
    cdef double arm_a, arm_b, center_a, center_b
    # x, y, z
    cdef double start[3]
    cdef double end[3]
    cdef double point[3]
    cdef readonly double radius, end_radius, angle

    @cython.locals(end_a=double, end_b=double, angle=double)
    cdef int _find_angle(self, bint is_clockwise) except -1
    @cython.locals(turned=double, radius=double, cosine=double, sine=double)
    cdef int _find_point(self, double share) except -1
    @cython.locals(from_a=double, from_b=double, to_a=double, to_b=double)
    cdef double _turn_around(self, double a, double b) except? -100.
