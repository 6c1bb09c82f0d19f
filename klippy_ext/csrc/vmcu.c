/* SPDX-License-Identifier: GPL-3.0-or-later
 * One micro-controller of a virtual world.  See vmcu.h. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include "vmcu.h"

/*
 * Services to the firmware
 */

static void
host_tx(void *ctx, uint64_t clock, const uint8_t *buf, uint32_t len)
{
    struct vmcu *m = ctx;

    vlink_write(&m->link, VLINK_FROM_MCU, vmcu_time_at(m, clock), buf, len);
}

static void
host_pin_out(void *ctx, uint64_t clock, uint32_t pin, uint8_t level)
{
    struct vmcu *m = ctx;

    if (pin < m->pins.n_pins)
        vpins_note_level(&m->pins, clock, pin, !!level);
}

static uint8_t
host_pin_in(void *ctx, uint64_t clock, uint32_t pin, int8_t pull)
{
    struct vmcu *m = ctx;

    (void)clock;
    return pin < m->pins.n_pins ? vpins_read_level(&m->pins, pin, pull) : 0;
}

static uint16_t
host_adc_in(void *ctx, uint64_t clock, uint32_t pin)
{
    struct vmcu *m = ctx;

    (void)clock;
    return pin < m->pins.n_pins ? m->pins.pins[pin].analog : 0;
}

static void
host_pwm_out(void *ctx, uint64_t clock, uint32_t pin, uint32_t cycle_ticks,
             uint32_t value, uint32_t max)
{
    struct vmcu *m = ctx;

    (void)cycle_ticks;
    if (pin < m->pins.n_pins && max)
        vpins_note_pwm(&m->pins, clock, pin, (double)value / (double)max);
}

/* Without a device on the bus the data line floats high. */
static void
host_spi(void *ctx, uint64_t clock, uint32_t bus, uint8_t *buf, uint32_t len)
{
    struct vmcu *m = ctx;

    (void)clock;
    if (m->bus.spi)
        m->bus.spi(m->bus.ctx, bus, buf, len);
    else
        memset(buf, 0xff, len);
}

/* Without a device on the bus the address is not acknowledged. */
static int32_t
host_i2c(void *ctx, uint64_t clock, uint32_t bus, uint8_t addr,
         const uint8_t *wr, uint32_t wr_len, uint8_t *rd, uint32_t rd_len)
{
    struct vmcu *m = ctx;

    (void)clock;
    memset(rd, 0xff, rd_len);
    if (!m->bus.i2c)
        return -ENXIO;
    return m->bus.i2c(m->bus.ctx, bus, addr, wr, wr_len, rd, rd_len);
}

static void
host_reset(void *ctx, uint64_t clock)
{
    struct vmcu *m = ctx;

    m->wants_reset = 1;
    m->reset_clock = clock;
}

static void
host_late(void *ctx, uint64_t clock, uint64_t late)
{
    struct vmcu *m = ctx;

    (void)clock;
    m->n_late++;
    if (late > m->max_late)
        m->max_late = late;
}

/*
 * The private copy of the firmware
 */

static int
fail(struct vmcu *m, const char *what, const char *why)
{
    snprintf(m->error, sizeof(m->error), "%s '%s' for mcu '%s': %s", what,
             m->library, m->name, why);
    return -1;
}

static int
copy_file(int to, const char *path)
{
    int from = open(path, O_RDONLY | O_CLOEXEC);
    struct stat st;
    off_t pos = 0;
    int ret = -1;

    if (from < 0)
        return -1;
    if (!fstat(from, &st)) {
        while (pos < st.st_size
               && sendfile(to, from, &pos, (size_t)(st.st_size - pos)) > 0)
            ;
        ret = pos == st.st_size ? 0 : -1;
    }
    close(from);
    return ret;
}

/* The copy's descriptor stays open while it is in use: the loader knows the
 * file by the path that the descriptor has in /proc. */
static int
load_copy(struct vmcu *m)
{
    const struct vmcu_ops *(*get_ops)(void);
    char path[64];

    m->copy_fd = memfd_create("vmcu", MFD_CLOEXEC);
    if (m->copy_fd < 0 || copy_file(m->copy_fd, m->library) < 0)
        return fail(m, "cannot read firmware", strerror(errno));
    snprintf(path, sizeof(path), "/proc/self/fd/%d", m->copy_fd);
    m->handle = dlopen(path, RTLD_LOCAL | RTLD_NOW);
    if (!m->handle)
        return fail(m, "cannot load firmware", dlerror());
    *(void **)&get_ops = dlsym(m->handle, "vmcu_get_ops");
    if (!get_ops)
        return fail(m, "no vmcu_get_ops() in", "not a simulator firmware");
    m->ops = get_ops();
    if (m->ops->abi_version != VMCU_ABI_VERSION)
        return fail(m, "cannot use firmware", "built for another version of"
                    " vmcu_abi.h");
    return 0;
}

static void
unload_copy(struct vmcu *m)
{
    if (m->handle)
        dlclose(m->handle);
    if (m->copy_fd >= 0)
        close(m->copy_fd);
    m->handle = NULL;
    m->copy_fd = -1;
    m->ops = NULL;
}

static void
note_next(struct vmcu *m, uint64_t next)
{
    m->next_clock = next;
    m->next_time = next == UINT64_MAX ? INFINITY : vmcu_time_at(m, next);
}

static int
power_on(struct vmcu *m, double time, uint64_t clock)
{
    m->base_time = time;
    m->base_clock = m->done_clock = clock;
    m->wants_reset = 0;
    if (m->ops->power_on(&m->host, clock))
        return fail(m, "cannot start firmware", "power_on() failed");
    note_next(m, m->ops->run(clock));
    return 0;
}

/*
 * Life
 */

uint64_t
vmcu_clock_at(const struct vmcu *m, double time)
{
    double ticks = floor((time - m->base_time) * m->rate);

    return m->base_clock + (ticks > 0. ? (uint64_t)ticks : 0);
}

double
vmcu_time_at(const struct vmcu *m, uint64_t clock)
{
    double ticks = (double)(int64_t)(clock - m->base_clock);

    return m->base_time + ticks / m->rate;
}

void
vmcu_set_ppm(struct vmcu *m, double time, double ppm)
{
    uint64_t clock = vmcu_clock_at(m, time);

    /* The tick that runs now ends as it began */
    m->base_time = vmcu_time_at(m, clock);
    m->base_clock = clock;
    if (m->done_clock < clock)
        m->done_clock = clock;
    m->rate = m->freq * (1. + ppm * 1e-6);
    note_next(m, m->next_clock);
}

int
vmcu_open(struct vmcu *m, const struct vmcu_options *o, const double *now)
{
    memset(m, 0, sizeof(*m));
    m->copy_fd = -1;
    m->host = (struct vmcu_host) {
        .ctx = m, .tx = host_tx, .pin_out = host_pin_out,
        .pin_in = host_pin_in, .adc_in = host_adc_in,
        .pwm_out = host_pwm_out, .spi = host_spi, .i2c = host_i2c,
        .reset = host_reset, .late = host_late,
    };
    vlink_init(&m->link, o->baud, o->latency, o->seed, now);
    m->name = strdup(o->name);
    m->library = strdup(o->library);
    if (!m->name || !m->library)
        return -1;
    if (load_copy(m))
        return -1;
    m->freq = o->freq > 0. ? o->freq : (double)m->ops->clock_freq;
    m->rate = m->freq * (1. + o->ppm * 1e-6);
    if (vpins_init(&m->pins, m->ops->n_pins))
        return fail(m, "cannot open firmware", strerror(ENOMEM));
    return power_on(m, *now, o->start_clock);
}

void
vmcu_close(struct vmcu *m)
{
    if (m->ops)
        m->ops->power_off();
    unload_copy(m);
    vlink_free(&m->link);
    vpins_free(&m->pins);
    free(m->name);
    free(m->library);
    m->name = m->library = NULL;
}

int
vmcu_reset(struct vmcu *m, double time)
{
    uint64_t clock = vmcu_clock_at(m, time);

    if (clock < m->done_clock)
        clock = m->done_clock;
    vpins_reset(&m->pins, clock);
    vlink_drop(&m->link);
    m->n_resets++;
    note_next(m, UINT64_MAX);
    if (m->ops)
        m->ops->power_off();
    unload_copy(m);
    if (load_copy(m))
        return -1;
    return power_on(m, time, 0);
}

/* Resets and what the firmware does after them, up to `time`. */
static int
follow_resets(struct vmcu *m, double time)
{
    while (m->wants_reset) {
        double reset_time = vmcu_time_at(m, m->reset_clock);
        m->done_clock = m->reset_clock;
        if (vmcu_reset(m, reset_time))
            return -1;
        if (m->next_time <= time && !m->wants_reset) {
            m->done_clock = vmcu_clock_at(m, time);
            note_next(m, m->ops->run(m->done_clock));
        }
    }
    return 0;
}

int
vmcu_run(struct vmcu *m, double time)
{
    uint64_t until = vmcu_clock_at(m, time);

    if (!m->ops)
        return 0;
    if (until < m->next_clock && m->next_clock != UINT64_MAX)
        until = m->next_clock;
    m->done_clock = until;
    m->n_runs++;
    note_next(m, m->ops->run(until));
    return m->wants_reset ? follow_resets(m, time) : 0;
}

int
vmcu_receive(struct vmcu *m, double time, const uint8_t *buf, size_t len)
{
    uint64_t clock = vmcu_clock_at(m, time);

    if (!m->ops)
        return 0;
    if (clock > m->done_clock)
        m->done_clock = clock;
    if (!m->ops->rx(m->done_clock, buf, (uint32_t)len))
        m->rx_dropped += len;
    note_next(m, m->ops->run(m->done_clock));
    return m->wants_reset ? follow_resets(m, time) : 0;
}

int
vmcu_check(const struct vmcu *m)
{
    int ret;

    if (!(m->freq > 0.) || !(m->rate > 0.) || !isfinite(m->base_time))
        return -91;
    if (!m->error[0] && (!m->ops || !m->handle
                         || m->done_clock < m->base_clock))
        return -92;
    ret = vlink_check(&m->link);
    return ret ? ret : vpins_check(&m->pins);
}
