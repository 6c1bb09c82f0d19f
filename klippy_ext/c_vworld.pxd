# SPDX-License-Identifier: GPL-3.0-or-later
from libc.stdint cimport int8_t, int32_t, int64_t, uint8_t, uint16_t, uint32_t, uint64_t

from klippy_ext.c_hostclock cimport hostclock


cdef extern from "vlink.h" nogil:
    struct vlane:
        uint64_t n_bytes

    struct vrecord:
        uint8_t *buf
        size_t used
        int is_full

    struct vlink_faults:
        double flip
        double drop
        double insert
        double twice
        double *jitter

    struct vlink:
        vlane *lanes
        int has_host
        vrecord record

    enum:
        VLINK_TO_MCU
        VLINK_FROM_MCU

    void vlink_set_faults(vlink *link, const vlink_faults *faults)
    void vlink_cut(vlink *link, int is_cut)
    void vlink_record(vlink *link, int is_on)


cdef extern from "vtrace.h" nogil:
    struct vstep:
        uint8_t both_edges
        int64_t position
        uint64_t n_steps
        uint8_t is_recording
        uint8_t is_full
        int64_t *record
        size_t used

    struct voutput:
        double fraction

    struct vedge:
        int64_t clock
        int64_t pin
        double fraction

    struct vedgelog:
        vedge *edges
        size_t used
        int is_full

    struct vpin:
        uint8_t level
        uint8_t is_known
        uint8_t input
        uint8_t has_input
        uint16_t analog

    struct vpins:
        uint32_t n_pins
        uint64_t epoch
        vpin *pins

    vstep *vpins_watch_step(
        vpins *v, uint32_t step_pin, uint32_t dir_pin, int invert_step,
        int invert_dir, int both_edges)
    voutput *vpins_watch_output(
        vpins *v, uint32_t pin, int invert, uint64_t clock)
    vedgelog *vpins_new_log(vpins *v)
    int vpins_tap(vpins *v, vedgelog *log, uint32_t pin)
    int vpins_bind_switch(
        vpins *v, uint32_t pin, vstep **steps, const double *coeffs,
        int n_steps, double threshold, int is_above, int invert)
    double voutput_read_duty(voutput *o, uint64_t total_ticks)


cdef extern from "vmcu.h" nogil:
    struct vmcu_ops:
        int (*find_pin)(const char *name) noexcept

    struct vmcu_options:
        const char *name
        const char *library
        double freq
        double ppm
        double baud
        double latency
        uint64_t seed
        uint64_t start_clock

    struct vbus:
        void *ctx
        void (*spi)(void *ctx, uint32_t bus, uint8_t *buf, uint32_t len) noexcept
        int32_t (*i2c)(
            void *ctx, uint32_t bus, uint8_t addr, const uint8_t *wr,
            uint32_t wr_len, uint8_t *rd, uint32_t rd_len) noexcept

    struct vmcu:
        const vmcu_ops *ops
        double freq
        uint64_t done_clock
        vpins pins
        vbus bus
        vlink link
        uint64_t n_late
        uint64_t max_late
        uint64_t n_resets
        uint64_t rx_dropped
        char *error

    uint64_t vmcu_clock_at(const vmcu *m, double time)
    double vmcu_time_at(const vmcu *m, uint64_t clock)
    void vmcu_set_ppm(vmcu *m, double time, double ppm)
    int vmcu_reset(vmcu *m, double time)


cdef extern from "vworld.h" nogil:
    enum vworld_event:
        VWORLD_LIMIT
        VWORLD_HOST
        VWORLD_TICKER
        VWORLD_ERROR

    struct vworld:
        pass

    struct vworld_stats:
        uint64_t n_events
        uint64_t n_slices
        uint64_t n_runs

    vworld *vworld_new(uint64_t seed)
    void vworld_free(vworld *w)
    hostclock *vworld_get_clock(vworld *w)
    double vworld_get_now(const vworld *w)
    uint64_t vworld_make_seed(vworld *w)
    vmcu *vworld_add_mcu(vworld *w, const vmcu_options *o)
    int vworld_add_ticker(vworld *w, double period)
    ctypedef double (*vworld_alarm_fn)(void *ctx, double now) noexcept nogil

    int vworld_add_alarm(vworld *w, vworld_alarm_fn run, void *ctx)
    void vworld_set_alarm(vworld *w, int alarm, double wake)
    void vworld_drop_alarm(vworld *w, int alarm)
    void vworld_limit_slice(vworld *w, double slice)
    vworld_event vworld_run(vworld *w, double limit)
    int vworld_get_ticker(const vworld *w)
    const char *vworld_get_error(const vworld *w)
    void vworld_get_stats(const vworld *w, vworld_stats *stats)
