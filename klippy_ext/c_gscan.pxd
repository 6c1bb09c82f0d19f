# SPDX-License-Identifier: GPL-3.0-or-later
# C declarations of csrc/gscan.h

cdef extern from "gscan.h" nogil:
    struct gscan:
        unsigned mask
        double value[5]
    int gscan_line(const char *s, size_t length, gscan *out)
    size_t gscan_line_length(const char *s, size_t length)
