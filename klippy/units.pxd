# SPDX-License-Identifier: GPL-3.0-or-later
# Names for the units of typed values; a type says what its number means.
ctypedef double sec_t
ctypedef double mm_t
ctypedef double mm_s_t
ctypedef double mm_s2_t
ctypedef double celsius_t
ctypedef long long tick_t
