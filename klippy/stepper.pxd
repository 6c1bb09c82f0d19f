# SPDX-License-Identifier: GPL-3.0-or-later
from klippy.units cimport sec_t
from klippy_ext.itersolve cimport StepperKinematics
from klippy_ext.stepcompress cimport StepCompress
from klippy_ext.trapq cimport TrapQ


cdef class MCU_stepper:
    cdef dict __dict__
    cdef object __weakref__
    cdef readonly object mcu
    cdef readonly StepCompress stepcompress
    cdef readonly StepperKinematics kinematics
    cdef TrapQ trapq
    cdef object printer, motion_queuing
    cdef str name
    cdef int oid
    cdef bint is_angular
    # What a turn of the last gear is in mm (or radians) and in steps
    cdef double rotation_dist, steps_per_rotation
    cdef str step_pin, dir_pin
    cdef int invert_step
    cdef int invert_dir, config_invert_dir
    # Length of a step pulse, None: not chosen yet
    cdef object pulse_duration
    cdef bint wants_both_edges
    # Numbers of messages; what asks for the position
    cdef object queue_step_tag, set_dir_tag, reset_message, position_query
    cdef readonly list active_callbacks

    cpdef double get_step_dist(self) except? -1.
    cpdef check_active(self, double print_time)
