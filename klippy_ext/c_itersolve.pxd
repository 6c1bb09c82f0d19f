# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_stepcompress cimport stepcompress
from klippy_ext.c_trapq cimport trapq


cdef extern from "itersolve.h" nogil:
    enum:
        ITERSOLVE_EJUMP

    struct itersolve:
        double step_dist
        double scan_pre
        double scan_post

    void itersolve_set_trapq(itersolve *its, const trapq *tq)
    void itersolve_set_stepcompress(
        itersolve *its, stepcompress *sc, double step_dist)
    void itersolve_set_position(itersolve *its, const double *pos)
    double itersolve_calc_position(const itersolve *its, const double *pos)
    double itersolve_get_commanded_pos(const itersolve *its)
    int itersolve_is_active_axis(const itersolve *its, char axis)
    double itersolve_find_active(const itersolve *its, double until)
    int itersolve_generate(itersolve *its, double print_time)
    int itersolve_check(const itersolve *its)
