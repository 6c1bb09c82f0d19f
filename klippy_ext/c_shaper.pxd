# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_trapq cimport trapq


cdef extern from "shaper.h" nogil:
    enum:
        SHAPER_IMPULSES_MAX
        SHAPER_COEFFS_MAX

    struct shaper_axis:
        int n_impulses
        double[5] weights
        double[5] delays
        int n_coeffs
        double[12] coeffs
        double half

    struct shaper_path:
        double pre
        double post

    shaper_path *shaper_path_new()
    void shaper_path_delete(shaper_path *path)
    int shaper_path_set_axis(
        shaper_path *path, int axis, const shaper_axis *shaper)
    void shaper_attach(itersolve *its, shaper_path *path)
    int shaper_get_position(
        shaper_path *path, const trapq *tq, double time, double *pos)
    int shaper_path_check(const shaper_path *path)
