# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_shaper cimport shaper_path
from klippy_ext.c_trapq cimport trapq


cdef extern from "kin_extruder.h" nogil:
    enum advance_kind:
        ADVANCE_LINEAR
        ADVANCE_TANH
        ADVANCE_RECIPROCAL

    struct advance_model:
        advance_kind kind
        double linear
        double offset
        double velocity
        double smooth_time
        double time_offset

    struct drive_plan:
        double pre
        double post

    struct kin_extruder:
        drive_plan plan

    kin_extruder *kin_extruder_new()
    int kin_extruder_set_model(
        kin_extruder *k, double print_time, const advance_model *model)
    void kin_extruder_set_shaper(
        kin_extruder *k, const shaper_path *path, const trapq *head)
