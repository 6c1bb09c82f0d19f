# SPDX-License-Identifier: GPL-3.0-or-later
"""Owner of a stepguard: goes on with motion while the main thread does not."""

cimport cython
from libc.errno cimport ENOMEM

from klippy_ext.c_stepguard cimport (
    stepguard_add,
    stepguard_arm,
    stepguard_disarm,
    stepguard_free,
    stepguard_new,
    stepguard_plan,
    stepguard_result,
    stepguard_run,
    stepguard_start,
)
from klippy_ext.c_vworld cimport (
    vworld_add_alarm,
    vworld_drop_alarm,
    vworld_set_alarm,
)
from klippy_ext.hostclock cimport HostClock
from klippy_ext.itersolve cimport raise_error
from klippy_ext.steppersync cimport StepperSync
from klippy_ext.vworld cimport VirtualWorld


# noexcept: called from C, and nothing here can fail.
cdef double run_alarm(void *ctx, double now) noexcept nogil:
    return stepguard_run(<stepguard *>ctx, now)


@cython.no_gc_clear
cdef class StepGuard:
    """Makes the steps that are due when the main thread is not back in time.

    clock: a RealClock (then it has a thread, once it is armed), or a
    VirtualWorld, which calls it.
    """

    def __cinit__(self, HostClock clock not None):
        self.clock, self.alarm, self.syncs = clock, -1, []
        self.guard = stepguard_new(clock.clock)
        if self.guard is NULL:
            raise MemoryError()
        if isinstance(clock, VirtualWorld):
            self.world = clock
            self.alarm = vworld_add_alarm(self.world.world, run_alarm, self.guard)
            if self.alarm < 0:
                raise MemoryError()

    def __dealloc__(self):
        if self.alarm >= 0:
            vworld_drop_alarm(self.world.world, self.alarm)
        with nogil:
            stepguard_free(self.guard)

    def add(self, StepperSync sync not None):
        """Guard the steppers of this one too."""
        if stepguard_add(self.guard, sync.ss) < 0:
            raise MemoryError()
        self.syncs.append(sync)

    def arm(self, double reached, double certain, double end, double deadline,
            double slack):
        """Go on at eventtime `deadline`, unless disarmed before.

        Steps are made up to `reached`; the plan can change behind `certain`, and
        ends at rest at `end` (print_times).  More than slack s after the
        deadline it is too late to begin.  Raises OSError without a thread.
        """
        cdef stepguard_plan plan
        cdef int ret
        plan.reached, plan.certain, plan.end = reached, certain, end
        plan.deadline, plan.slack = deadline, slack
        if self.world is not None:
            vworld_set_alarm(self.world.world, self.alarm, deadline)
        elif not self.is_started:
            ret = stepguard_start(self.guard)
            if ret:
                raise OSError(-ret, "a thread for motion cannot be started")
            self.is_started = True
        stepguard_arm(self.guard, &plan)

    def disarm(self):
        """Where the steps end that are made now; None if it was not armed.

        Raises what StepperSync.generate() raises.
        """
        cdef stepguard_result result
        with nogil:
            result = stepguard_disarm(self.guard)
        if not result.is_armed:
            return None
        if result.error == -ENOMEM:
            raise MemoryError()
        raise_error(result.error, result.reached)
        return result.reached
