# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "realtime.h" nogil:
    void realtime_get_counts(int *n_raised, int *n_refused)
    int realtime_lock_memory()
