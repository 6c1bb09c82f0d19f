# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport uint32_t


cdef extern from "trapq.h" nogil:
    struct trapq:
        pass

    struct trap_move:
        double accel_t
        double cruise_t
        double decel_t
        double *start
        double *axes_r
        double start_v
        double cruise_v
        double accel
        double turn
        uint32_t normal

    struct trap_record:
        double print_time
        double move_t
        double start_v
        double accel
        double *start
        double *axes_r

    trapq *trapq_new()
    void trapq_delete(trapq *tq)
    int trapq_add(trapq *tq, double print_time, const trap_move *move)
    int trapq_add_like(
        trapq *tq, double print_time, const trap_move *move,
        const trap_move *like)
    int trapq_set_position(trapq *tq, double print_time, const double *pos)
    void trapq_mark(trapq *tq)
    void trapq_rewind(trapq *tq)
    void trapq_finalize(
        trapq *tq, double print_time, double clear_history_time)
    int trapq_extract(
        const trapq *tq, trap_record *out, int max, double start_time,
        double end_time)
    int trapq_check(const trapq *tq)
