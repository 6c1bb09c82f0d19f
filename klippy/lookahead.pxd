# SPDX-License-Identifier: GPL-3.0-or-later
cimport cython

from klippy.arcpath cimport ArcPath
from klippy.units cimport mm_s2_t, mm_s_t, mm_t, sec_t
from klippy_ext.trapq cimport TrapMove


cdef class MotionLimits:
    cdef readonly mm_s_t max_velocity
    cdef readonly mm_s2_t max_accel
    cdef readonly double min_cruise_ratio
    cdef readonly mm_s_t corner_velocity
    cdef readonly mm_t junction_deviation
    cdef readonly mm_s2_t gentle_accel


@cython.final
cdef class Move(TrapMove):
    # Ends (x, y, z starts are in TrapMove) and lengths
    cdef readonly mm_t start_e, end_x, end_y, end_z, end_e
    cdef readonly mm_t d_x, d_y, d_z, d_e
    cdef readonly double axes_r_e
    cdef readonly mm_t move_d
    cdef readonly bint is_kinematic_move
    # Axes beyond x, y, z, e: (start, end, way, way a mm) each, or None
    cdef readonly list extra
    # What it follows if it is no straight line; ways are those to its end
    cdef readonly ArcPath arc
    # What limits it; squares of speeds in (mm/s)^2
    cdef readonly mm_t junction_deviation
    cdef readonly double max_cruise_v2, delta_v2, gentle_v2
    cdef readonly sec_t min_move_t
    cdef readonly double max_start_v2, max_gentle_v2
    # The plan at its start, and the most it may cruise
    cdef double full_v2, calm_v2, cap_v2
    cdef readonly list timing_callbacks

    @cython.locals(velocity=double, gentle=double)
    cdef int set_path(self, MotionLimits limits, double speed) except -1
    cdef int set_arc(self, MotionLimits limits, ArcPath arc, double speed) except -1
    @cython.locals(speed2=double)
    cpdef int limit_speed(self, double speed, double accel) except -1
    @cython.locals(along=double, sine=double, cosine=double, radius=double,
                   corner=double)
    cdef double find_corner_v2(self, Move prev) except -1.
    @cython.locals(v2=double)
    cpdef int calc_junction(self, Move prev, double extra_v2) except -1
    cdef int forget_junction(self) except -1
    @cython.locals(cap=double, start_v2=double, cruise_v2=double, way=double,
                   half_inv_accel=double, end_v=double)
    cdef int set_profile(self, double end_v2) except -1


@cython.locals(move=Move)
cpdef Move make_move(MotionLimits limits, double x0, double y0, double z0, double e0,
                    double x1, double y1, double z1, double e1, list extra,
                    double speed)


@cython.locals(move=Move)
cpdef Move make_arc_move(MotionLimits limits, ArcPath arc, double start_e,
                         double end_e, double speed)


@cython.final
cdef class LookAheadQueue:
    cdef readonly list queue
    cdef double plan_time, time_left
    # The hill that moves already taken are on: its top so far, and the top of
    # the last of them
    cdef double hill_top, last_top
    # The plan at the end of what is looked at
    cdef double next_full_v2, next_calm_v2

    cpdef bint add_move(self, Move move) except -1
    cpdef Move get_last(self)
    @cython.locals(move=Move, i=Py_ssize_t, k=Py_ssize_t, n=Py_ssize_t,
                   n_full=Py_ssize_t, n_calm=Py_ssize_t, full=double, calm=double)
    cdef Py_ssize_t plan_backwards(self, bint is_final) except -1
    @cython.locals(move=Move, other=Move, first=Py_ssize_t, i=Py_ssize_t,
                   j=Py_ssize_t, top=double, hill_top=double, last_top=double,
                   calm=double)
    cdef Py_ssize_t cap_hills(self, Py_ssize_t count, bint is_final) except -1
    @cython.locals(move=Move, i=Py_ssize_t, end=Py_ssize_t, top=double, peak=double,
                   end_full=double)
    cdef Py_ssize_t close_hill(self, Py_ssize_t first, Py_ssize_t count,
                               double hill_top, bint is_final) except -1
    @cython.locals(move=Move)
    cdef double find_end_full(self, Py_ssize_t i) except -1.
    @cython.locals(move=Move)
    cdef double find_end_calm(self, Py_ssize_t i) except -1.
    @cython.locals(move=Move, i=Py_ssize_t, hill_top=double, last_top=double)
    cpdef plan_stop(self)
    @cython.locals(move=Move)
    cpdef list restart(self, Py_ssize_t count)
    @cython.locals(move=Move, count=Py_ssize_t, i=Py_ssize_t)
    cpdef list take(self, bint is_final)


cdef bint is_valley(double left, double bottom, double right) noexcept
