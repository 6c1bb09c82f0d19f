# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "kin_polar.h" nogil:
    struct kin_polar:
        pass

    double KIN_POLAR_CORE
    kin_polar *kin_polar_new()
