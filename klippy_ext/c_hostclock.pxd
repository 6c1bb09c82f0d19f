# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "hostclock.h" nogil:
    struct hostclock:
        pass

    double hostclock_now(const hostclock *hc)
    hostclock *hostclock_get_real()
