# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "kin_delta.h" nogil:
    struct kin_delta:
        pass

    kin_delta *kin_delta_new(double arm2, double tower_x, double tower_y)
