# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport uint8_t, uint64_t


cdef extern from "qmsg.h" nogil:
    enum:
        QMSG_DATA_MAX

    struct qmsg:
        qmsg *next
        uint64_t min_clock
        uint64_t req_clock
        uint64_t notify_id
        double sent_time
        double receive_time
        uint8_t len
        uint8_t *data

    struct qfifo:
        qmsg *head
        qmsg *tail

    struct qsink:
        void *ctx
        void (*send_batch)(void *ctx, qfifo *batch) noexcept

    void qmsg_free(qmsg *m)
    void qfifo_clear(qfifo *f)
    void qfifo_join(qfifo *dst, qfifo *src)
    qmsg *qfifo_pop(qfifo *f)
