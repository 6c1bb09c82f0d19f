# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.kinematics.linear cimport LinearMachine


cdef class CoreXZKinematics(LinearMachine):
    pass
