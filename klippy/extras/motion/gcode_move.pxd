# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.gcode cimport MoveSink
from klippy.toolhead cimport ToolHead
from klippy_ext.gscan cimport MoveScan


cdef class GCodeMove(MoveSink):
    cdef public object printer, gcode
    cdef public bint is_printer_ready
    # Modes
    cdef public bint absolute_coord, absolute_extrude
    # Axes in order x, y, z, e, further ones; mm
    cdef public list base_position, last_position, homing_position
    cdef public dict axis_map
    # mm/s; mm/s of one unit of F; factor of E
    cdef public double speed, speed_factor, extrude_factor
    cdef public dict saved_states
    # Where moves go; plain_toolhead if nothing is between
    cdef public object move_transform, position_with_transform
    cdef object _move_with_transform
    cdef ToolHead plain_toolhead

    @cython.locals(mask=cython.uint, x=double, y=double, z=double, e=double,
                   origin=list)
    cpdef int move_line(self, MoveScan scan) except -1
    @cython.locals(last=list)
    cpdef int make_move(self, double x, double y, double z, double e,
                        double speed) except -1
