# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport uint8_t, uint32_t, uint64_t

from klippy_ext.c_hostclock cimport hostclock
from klippy_ext.c_qmsg cimport qmsg, qsink
from klippy_ext.c_vworld cimport vlink


cdef extern from "cmdqueue.h" nogil:
    struct cmdqueue:
        qsink sink


cdef extern from "clockest.h" nogil:
    struct clockest:
        double freq
        double conv_time
        uint64_t conv_clock
        uint64_t last_clock


cdef extern from "sqcore.h" nogil:
    enum:
        SQCORE_HISTORY

    struct sqrecord:
        double time
        uint8_t *data
        uint8_t len

    struct sqstats:
        uint64_t bytes_write
        uint64_t bytes_read
        uint64_t bytes_retransmit
        uint64_t bytes_invalid
        uint64_t send_seq
        uint64_t receive_seq
        uint64_t retransmit_seq
        double srtt
        double rttvar
        double rto
        double freq
        uint32_t ready_bytes
        uint32_t upcoming_bytes


cdef extern from "serialqueue.h" nogil:
    enum serialqueue_kind:
        SERIALQUEUE_UART
        SERIALQUEUE_CAN

    struct serialqueue:
        pass

    serialqueue *serialqueue_open_fd(
        hostclock *clock, int fd, serialqueue_kind kind, uint32_t client_id)
    serialqueue *serialqueue_open_file(hostclock *clock, int fd)
    serialqueue *serialqueue_open_virtual(hostclock *clock, vlink *link)
    int serialqueue_close(serialqueue *sq)
    void serialqueue_free(serialqueue *sq)
    cmdqueue *serialqueue_add_queue(serialqueue *sq)
    int serialqueue_send(
        serialqueue *sq, cmdqueue *cq, const uint8_t *data, size_t len,
        uint64_t min_clock, uint64_t req_clock, uint64_t notify_id)
    qmsg *serialqueue_pull(serialqueue *sq, int wait)
    int serialqueue_has_input(serialqueue *sq)
    void serialqueue_set_byte_time(serialqueue *sq, double byte_time)
    void serialqueue_set_receive_window(serialqueue *sq, uint32_t count)
    void serialqueue_set_clockest(serialqueue *sq, const clockest *ce)
    void serialqueue_get_clockest(serialqueue *sq, clockest *ce)
    void serialqueue_get_stats(serialqueue *sq, sqstats *stats)
    void serialqueue_get_history(
        serialqueue *sq, sqrecord *sent, size_t *n_sent,
        sqrecord *received, size_t *n_received)
    int serialqueue_get_error(serialqueue *sq)
    int serialqueue_check(serialqueue *sq)
