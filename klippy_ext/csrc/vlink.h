/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A cable of a virtual world, between one mcu and one host endpoint.
 *
 * Each direction passes bytes one after the other at the baud rate and
 * delivers what was written together in pieces of up to VLINK_PIECE bytes,
 * each `latency` after its last byte.  Deliveries of a direction are in order.
 * Faults hit single bytes, jitter deliveries, by the link's own random
 * numbers, when they are written.
 *
 * Only the world's thread uses a link.  The times it is given never go back.
 */
#ifndef VLINK_H
#define VLINK_H

#include <stddef.h>
#include <stdint.h>

enum { VLINK_PIECE = 64 };

enum vlink_direction { VLINK_TO_MCU, VLINK_FROM_MCU, VLINK_DIRECTIONS };

struct vlink_faults {
    double flip, drop, insert, twice;   /* probabilities a byte */
    /* s, by which a delivery to, from the mcu is late, at random up to this */
    double jitter[2];
};

/* The host's end.  receive() returns whether the host should look now; run()
 * does what is due and returns when it wants to be called again. */
struct vlink_host {
    void *ctx;
    int (*receive)(void *ctx, double now, const uint8_t *buf, size_t len);
    double (*run)(void *ctx, double now);
};

struct vchunk {
    struct vchunk *next;
    double time;                /* s, of delivery */
    size_t len;
    uint8_t data[];
};

struct vlane {
    struct vchunk *head, *tail;
    double free_time;           /* s, when the wire takes the next byte */
    uint64_t n_bytes;           /* delivered */
};

struct vrecord {
    uint8_t *buf;
    size_t used, size;
    int is_on, is_full;
};

struct vlink {
    double byte_time, latency;  /* s */
    struct vlane lanes[VLINK_DIRECTIONS];
    struct vlink_host host;
    int has_host, is_cut;
    double wake;                /* s, when the host end wants to run */
    const double *now;          /* the world's time */
    struct vlink_faults faults;
    int has_faults;
    uint64_t rng;
    struct vrecord record;
};

void vlink_init(struct vlink *l, double baud, double latency, uint64_t seed,
                const double *now);
void vlink_free(struct vlink *l);
void vlink_attach(struct vlink *l, const struct vlink_host *host);
void vlink_detach(struct vlink *l);
/* Let the host end run at the world's present time. */
void vlink_wake(struct vlink *l);
void vlink_set_faults(struct vlink *l, const struct vlink_faults *faults);
void vlink_cut(struct vlink *l, int is_cut);

/* Put bytes on the wire at time `now`. */
void vlink_write(struct vlink *l, enum vlink_direction dir, double now,
                 const uint8_t *buf, size_t len);
/* Time of the next delivery, infinity if the wire is empty. */
double vlink_get_arrival(const struct vlink *l, enum vlink_direction dir);
/* Take the next delivery off the wire; free() it. */
struct vchunk *vlink_take(struct vlink *l, enum vlink_direction dir);
/* Lose all bytes that are on the wire. */
void vlink_drop(struct vlink *l);

/* 0, or a negative number that says which invariant does not hold. */
int vlink_check(const struct vlink *l);

/* Records are packed: double time, uint8 direction, uint32 length, bytes. */
void vlink_record(struct vlink *l, int is_on);

#endif
