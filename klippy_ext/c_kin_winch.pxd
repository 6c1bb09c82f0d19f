# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "kin_winch.h" nogil:
    struct kin_winch:
        pass

    kin_winch *kin_winch_new(double x, double y, double z)
    kin_winch *kin_winch_new_radius()
