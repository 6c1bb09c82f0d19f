# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport uint32_t, uint64_t

from klippy_ext.c_itersolve cimport itersolve
from klippy_ext.c_qmsg cimport qsink
from klippy_ext.c_stepcompress cimport stepcompress
from klippy_ext.c_steppool cimport steppool


cdef extern from "steppersync.h" nogil:
    struct steppersync:
        pass

    steppersync *steppersync_new(const qsink *sink, uint32_t move_count)
    void steppersync_delete(steppersync *ss)
    int steppersync_add(steppersync *ss, stepcompress *sc, itersolve *its)
    void steppersync_set_kinematics(
        steppersync *ss, int number, itersolve *its)
    void steppersync_set_time(steppersync *ss, double offset, double freq)
    int steppersync_generate(steppersync *ss, double print_time)
    int steppersync_start(
        steppersync *ss, steppool *pool, double print_time, uint64_t clock)
    int steppersync_finish(steppersync *ss)
    int steppersync_get_failed(const steppersync *ss)
    int steppersync_flush(
        steppersync *ss, uint64_t clock, uint64_t clear_clock)
    int steppersync_check(const steppersync *ss)
