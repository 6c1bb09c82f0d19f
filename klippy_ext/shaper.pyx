# SPDX-License-Identifier: GPL-3.0-or-later
"""The path of one stepper under input shaping.

Units: mm, s; times are print_time.
"""

from libc.string cimport memset

from klippy_ext.c_shaper cimport (
    SHAPER_COEFFS_MAX,
    SHAPER_IMPULSES_MAX,
    shaper_axis,
    shaper_get_position,
    shaper_path_check,
    shaper_path_delete,
    shaper_path_new,
    shaper_path_set_axis,
)
from klippy_ext.c_steppool cimport steppool_settle
from klippy_ext.trapq cimport TrapQ


cdef class ShapedPath:
    """The plan, averaged on each axis; for StepperKinematics.set_shaper()."""

    def __cinit__(self):
        self.path = shaper_path_new()
        if self.path is NULL:
            raise MemoryError()

    def __dealloc__(self):
        shaper_path_delete(self.path)

    cdef set_axis(self, int axis, shaper_axis *shaper):
        if self.is_used:
            raise RuntimeError("a shaped path is set up before it is used")
        if not 0 <= axis < 3:
            raise ValueError("axis must be 0, 1 or 2, not %d" % (axis,))
        if shaper_path_set_axis(self.path, axis, shaper):
            raise ValueError("the weights of a shaper are finite and their sum"
                             " is 1, over a time above 0")

    def set_impulses(self, axis, weights, delays):
        """Average by weights (sum 1) of the plan so many s ago; axis is 0..2.

        Raises ValueError for values that are no average.
        """
        cdef shaper_axis shaper
        memset(&shaper, 0, sizeof(shaper))
        n = len(weights)
        if not 1 <= n <= SHAPER_IMPULSES_MAX or len(delays) != n:
            raise ValueError("a shaper has 1 to %d impulses, each with weight"
                             " and delay" % (SHAPER_IMPULSES_MAX,))
        shaper.n_impulses = n
        for i in range(n):
            shaper.weights[i], shaper.delays[i] = weights[i], delays[i]
        self.set_axis(axis, &shaper)

    def set_kernel(self, axis, coeffs, double half):
        """Average by a polynomial of u = delay / half, between -1 and 1.

        coeffs: by power of u; its integral is 1.  half: s.
        Raises ValueError for values that are no average.
        """
        cdef shaper_axis shaper
        memset(&shaper, 0, sizeof(shaper))
        n = len(coeffs)
        if not 1 <= n <= SHAPER_COEFFS_MAX:
            raise ValueError("a kernel has 1 to %d coefficients"
                             % (SHAPER_COEFFS_MAX,))
        shaper.n_coeffs, shaper.half = n, half
        for i in range(n):
            shaper.coeffs[i] = coeffs[i]
        self.set_axis(axis, &shaper)

    def scan_window(self):
        """(pre, post): s of the plan around a time that the path depends on."""
        return self.path.pre, self.path.post

    def get_position(self, TrapQ tq, double time):
        """(x, y, z) of the path through what is planned."""
        cdef double[3] pos
        steppool_settle()
        if shaper_get_position(self.path, tq.tq, time, pos):
            raise ValueError("nothing is planned")
        return pos[0], pos[1], pos[2]

    def check(self):
        """Raise AssertionError if an invariant does not hold (for tests)."""
        steppool_settle()
        cdef int ret = shaper_path_check(self.path)
        if ret:
            raise AssertionError("shaper is inconsistent: %d" % (ret,))
