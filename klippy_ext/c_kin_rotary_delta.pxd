# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "kin_rotary_delta.h" nogil:
    struct kin_rotary_delta:
        pass

    kin_rotary_delta *kin_rotary_delta_new(
        double shoulder_radius, double shoulder_height, double direction,
        double upper, double lower)
