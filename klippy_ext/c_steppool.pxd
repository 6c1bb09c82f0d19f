# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "steppool.h" nogil:
    struct steppool:
        pass

    steppool *steppool_new(int n_threads)
    void steppool_delete(steppool *p)
    void steppool_start(steppool *p)
    void steppool_finish(steppool *p)
    void steppool_settle()
    int steppool_check(steppool *p)
