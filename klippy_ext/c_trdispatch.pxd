# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport uint32_t, uint64_t

from klippy_ext.c_serialqueue cimport cmdqueue, serialqueue


cdef extern from "trdispatch.h" nogil:
    struct trdispatch:
        pass

    struct trmember:
        pass

    struct trmember_tags:
        uint32_t oid
        uint32_t set_timeout
        uint32_t trigger
        uint32_t state

    trdispatch *trdispatch_new()
    void trdispatch_free(trdispatch *td)
    trmember *trdispatch_add(
        trdispatch *td, serialqueue *sq, cmdqueue *cq,
        const trmember_tags *tags)
    void trmember_free(trmember *tm)
    void trmember_setup(
        trmember *tm, uint64_t clock, uint64_t expire_ticks,
        uint64_t min_extend_ticks)
    void trdispatch_arm(trdispatch *td, uint32_t reason)
    void trdispatch_disarm(trdispatch *td)
