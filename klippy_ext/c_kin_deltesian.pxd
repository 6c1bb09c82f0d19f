# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.c_kin_delta cimport kin_delta


cdef extern from "kin_deltesian.h" nogil:
    kin_delta *kin_deltesian_new(double arm2, double tower_x)
