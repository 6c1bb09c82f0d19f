# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "motionlock.h" nogil:
    void motionlock_take()
    void motionlock_give()
