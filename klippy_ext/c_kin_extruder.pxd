# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "kin_extruder.h" nogil:
    struct kin_extruder:
        pass

    kin_extruder *kin_extruder_new()
    int kin_extruder_set_advance(
        kin_extruder *k, double print_time, double advance,
        double smooth_time)
