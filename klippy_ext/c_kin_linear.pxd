# SPDX-License-Identifier: GPL-3.0-or-later
cdef extern from "kin_linear.h" nogil:
    struct kin_linear:
        pass

    kin_linear *kin_linear_new(double cx, double cy, double cz)
    void kin_linear_set(kin_linear *k, double cx, double cy, double cz,
                        double offset)
