# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of the kinematics of a stepper: from planned motion to step times.

Units: mm, s; times are print_time.
"""

cimport cython
from libc.errno cimport ENOMEM
from libc.stdint cimport uintptr_t
from libc.stdlib cimport free

from klippy_ext.c_itersolve cimport (
    ITERSOLVE_EJUMP,
    itersolve,
    itersolve_calc_position,
    itersolve_check,
    itersolve_find_active,
    itersolve_generate,
    itersolve_get_commanded_pos,
    itersolve_is_active_axis,
    itersolve_set_position,
    itersolve_set_stepcompress,
    itersolve_set_trapq,
)
from klippy_ext.c_shaper cimport shaper_attach
from klippy_ext.c_steppool cimport steppool_settle
from klippy_ext.shaper cimport ShapedPath
from klippy_ext.stepcompress cimport StepCompress
from klippy_ext.trapq cimport TrapQ


@cython.no_gc_clear
cdef class StepperKinematics:
    """One stepper's way of moving; the modules kin_* have the kinds."""

    def __dealloc__(self):
        if self.is_owner:
            free(self.its)

    @staticmethod
    def from_pointer(address, origin=None):
        """Wrap kinematics that somebody else owns, by their address.

        origin: an object to keep alive with the wrapper.
        Raises ValueError for address 0.
        """
        cdef StepperKinematics self = StepperKinematics.__new__(
            StepperKinematics)
        self.its = <itersolve *><uintptr_t>address
        self.origin = origin
        self.get()
        return self

    cdef itersolve *get(self) except NULL:
        # Nobody else works with it while the caller does
        steppool_settle()
        if self.its is NULL:
            raise ValueError("stepper kinematics of no kind: make one of"
                             " LinearKinematics, DeltaKinematics, ...")
        return self.its

    def set_trapq(self, TrapQ tq):
        """Take the moves from this queue; None to stand still."""
        itersolve_set_trapq(self.get(), tq.tq if tq is not None else NULL)
        self.trapq = tq

    def set_shaper(self, ShapedPath shaper):
        """Follow this path from now on; None to follow the plan.

        A path is for one stepper.  All steps must be made, and the plan must
        rest as far as the old and the new path look around that time.
        """
        cdef itersolve *its = self.get()
        if shaper is not None:
            if shaper.is_used:
                raise ValueError("a shaped path is for one stepper")
            shaper.is_used = True
        shaper_attach(its, shaper.path if shaper is not None else NULL)
        self.shaper = shaper

    def set_stepcompress(self, StepCompress sc, double step_dist):
        """Hand steps of step_dist mm to sc; None to count them only."""
        if not step_dist > 0.:
            raise ValueError("step distance must be above 0, not %r"
                             % (step_dist,))
        itersolve_set_stepcompress(
            self.get(), sc.sc if sc is not None else NULL, step_dist)
        self.stepcompress = sc

    def set_position(self, double x, double y, double z):
        """The stepper stands exactly right for this position, as it is."""
        cdef double[3] pos = [x, y, z]
        itersolve_set_position(self.get(), pos)

    def get_commanded_pos(self):
        """Where the steps made so far have moved the stepper (mm)."""
        return itersolve_get_commanded_pos(self.get())

    def calc_position_from_coord(self, double x, double y, double z):
        """Stepper position (mm) for a machine that rests there."""
        cdef double[3] pos = [x, y, z]
        return itersolve_calc_position(self.get(), pos)

    def is_active_axis(self, axis):
        """Can a move along the axis ("x", "y", "z") move the stepper?"""
        name = axis if isinstance(axis, bytes) else axis.encode()
        return bool(itersolve_is_active_axis(self.get(), ord(name)))

    def generate_steps(self, double print_time):
        """Make all steps up to print_time.  Never blocks.

        Raises ValueError if the position jumps: set_position() is missing.
        """
        cdef itersolve *its = self.get()
        cdef int ret
        with nogil:
            ret = itersolve_generate(its, print_time)
        raise_error(ret, print_time)

    def check_active(self, double print_time):
        """Start of the first move up to print_time that moves the stepper.

        0. if there is none among those whose steps are not made yet.
        """
        return itersolve_find_active(self.get(), print_time)

    def scan_window(self):
        """(pre, post): s of motion around a time that its steps depend on."""
        cdef itersolve *its = self.get()
        return its.scan_pre, its.scan_post

    def check(self):
        """Raise AssertionError if an invariant does not hold (for tests)."""
        cdef int ret = itersolve_check(self.get())
        if ret:
            raise AssertionError("itersolve is inconsistent: %d" % (ret,))


cdef int raise_error(int ret, double print_time) except -1:
    """Turn an error of itersolve_generate() into an exception."""
    if ret == -ENOMEM:
        raise MemoryError()
    if ret == ITERSOLVE_EJUMP:
        raise ValueError(
            "the position of a stepper jumps before print time %.6f: its"
            " position must be set when the toolhead's is" % (print_time,))
    return 0
