# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport int32_t, int64_t, uint8_t, uint32_t, uint64_t


cdef extern from "stepcompress.h" nogil:
    struct stephistory:
        int64_t first_clock
        int64_t last_clock
        int64_t start_position
        int32_t count
        int32_t add
        uint32_t interval

    struct stepcompress_options:
        uint32_t max_error
        uint32_t queue_step_tag
        uint32_t set_dir_tag
        int invert_dir

    struct stepcompress:
        pass

    stepcompress *stepcompress_new(uint32_t oid)
    void stepcompress_delete(stepcompress *sc)
    void stepcompress_configure(
        stepcompress *sc, const stepcompress_options *options)
    void stepcompress_set_time(stepcompress *sc, double offset, double freq)
    int stepcompress_push(
        stepcompress *sc, const double *times, int n, int dir)
    void stepcompress_note_made(stepcompress *sc, double print_time)
    int stepcompress_reset(stepcompress *sc, int64_t clock)
    int stepcompress_add_message(
        stepcompress *sc, const uint8_t *data, size_t len,
        uint64_t req_clock)
    int stepcompress_set_last_position(
        stepcompress *sc, int64_t clock, int64_t position)
    int64_t stepcompress_get_last_position(const stepcompress *sc)
    int64_t stepcompress_find_position(const stepcompress *sc, int64_t clock)
    int stepcompress_extract(
        const stepcompress *sc, stephistory *out, int max, int64_t start,
        int64_t end)
    void stepcompress_get_counts(
        const stepcompress *sc, uint64_t *n_steps, uint64_t *n_runs)
    int stepcompress_check(const stepcompress *sc)
