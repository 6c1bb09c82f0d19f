# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_hostclock cimport hostclock
from klippy_ext.c_steppersync cimport steppersync


cdef extern from "stepguard.h" nogil:
    struct stepguard:
        pass

    struct stepguard_plan:
        double reached
        double certain
        double end
        double deadline
        double slack

    struct stepguard_result:
        double reached
        int is_armed
        int error

    stepguard *stepguard_new(hostclock *clock)
    void stepguard_free(stepguard *g)
    int stepguard_start(stepguard *g)
    int stepguard_add(stepguard *g, steppersync *ss)
    void stepguard_arm(stepguard *g, const stepguard_plan *plan)
    stepguard_result stepguard_disarm(stepguard *g)
    double stepguard_run(stepguard *g, double now)
