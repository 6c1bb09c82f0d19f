# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.kinematics.box cimport BoxMachine


cdef class LinearMachine(BoxMachine):
    # Rows: the position of an axis as a sum of those of the rails
    cdef list inverse
