# SPDX-License-Identifier: GPL-3.0-or-later
from klippy_ext.gscan cimport MoveScan


cdef class MoveSink:
    cdef dict __dict__
    cdef object __weakref__
    cpdef int move_line(self, MoveScan scan) except -1


cdef class ScriptMutex:
    cdef object _mutex
    cdef public int n_waiting
    cdef public list runs


cdef class LineRunner:
    cdef GCodeDispatch dispatch
    cdef MoveScan scan
    cdef MoveSink sink
    cdef object sink_g0
    cdef object sink_g1
    cdef bint _is_sink_active(self) except -1
    cdef int _run_move(self, object line) except -1
    cpdef Py_ssize_t find_next(self, bytes block, Py_ssize_t pos) except -2
    cpdef int run_found(self, bytes block, Py_ssize_t pos, Py_ssize_t end) except -1
    cpdef int run_line(self, str line, bint need_ack) except -1


cdef class GCodeDispatch:
    cdef dict __dict__
    cdef object __weakref__
    cdef public object printer
    cdef public ScriptMutex mutex
    cdef public LineRunner runner
    cdef public object interrupts
    cdef public bint is_printer_ready
    cdef public bint is_fileinput
    cdef public list output_callbacks
    cdef public dict base_gcode_handlers
    cdef public dict ready_gcode_handlers
    cdef public dict gcode_handlers
    cdef public dict mux_commands
    cdef public dict gcode_help
    cdef public dict status_commands
    cdef public set told_commands
