/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * One micro-controller of a virtual world: a private copy of a shared object
 * (vmcu_abi.h), its clock, its pins and its link.
 *
 * The clock runs at freq * (1 + ppm * 1e-6) from base_clock at base_time (s,
 * world).  A reset power-cycles the firmware: a fresh copy of the file, the
 * clock back at 0, all bytes on the wire lost.
 */
#ifndef VMCU_H
#define VMCU_H

#include "vlink.h"
#include "vmcu_abi.h"
#include "vtrace.h"

struct vmcu_options {
    const char *name, *library;
    double freq;                /* Hz, 0: what the firmware says */
    double ppm;                 /* error of the crystal */
    double baud, latency;       /* of the link; Hz, s */
    uint64_t seed;              /* of the link's faults */
    uint64_t start_clock;       /* ticks at power-up */
};

/* What is connected to the buses; NULL: nothing is.  Called from inside
 * vmcu_run() and its like; must not call back into the mcu. */
struct vbus {
    void *ctx;
    void (*spi)(void *ctx, uint32_t bus, uint8_t *buf, uint32_t len);
    int32_t (*i2c)(void *ctx, uint32_t bus, uint8_t addr, const uint8_t *wr,
                   uint32_t wr_len, uint8_t *rd, uint32_t rd_len);
};

struct vmcu {
    char *name, *library;
    void *handle;
    int copy_fd;
    const struct vmcu_ops *ops;
    struct vmcu_host host;
    double freq, rate;          /* nominal and true, Hz */
    double base_time;
    uint64_t base_clock;
    uint64_t done_clock;        /* everything up to here has happened */
    uint64_t next_clock;        /* of its next event, UINT64_MAX: none */
    double next_time;
    int wants_reset;
    uint64_t reset_clock;
    struct vpins pins;
    struct vbus bus;
    struct vlink link;
    uint64_t n_late, max_late, n_resets, n_runs, rx_dropped;
    char error[256];            /* why it cannot go on, "" while it can */
};

/* Power up at world time *now.  Returns 0, or -1 with a text in m->error;
 * either way vmcu_close() gives the memory back. */
int vmcu_open(struct vmcu *m, const struct vmcu_options *o,
              const double *now);
void vmcu_close(struct vmcu *m);
uint64_t vmcu_clock_at(const struct vmcu *m, double time);
double vmcu_time_at(const struct vmcu *m, uint64_t clock);
/* From `time` on the crystal is off by so many parts per million. */
void vmcu_set_ppm(struct vmcu *m, double time, double ppm);
/* Let everything up to `time` happen, and at least the next event.  Returns
 * 0, or -1 if a reset failed. */
int vmcu_run(struct vmcu *m, double time);
/* Bytes arrive at `time`; as vmcu_run(). */
int vmcu_receive(struct vmcu *m, double time, const uint8_t *buf,
                 size_t len);
/* Power-cycle at `time`; as vmcu_run(). */
int vmcu_reset(struct vmcu *m, double time);
/* 0, or a negative number that says which invariant does not hold. */
int vmcu_check(const struct vmcu *m);

#endif
