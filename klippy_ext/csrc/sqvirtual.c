/* SPDX-License-Identifier: GPL-3.0-or-later
 * Serial queue on a link of a virtual world: the world calls it when bytes
 * arrive and when its time has come. */
#include "serialqueue_internal.h"
#include "vlink.h"

static void
kick_link(struct serialqueue *sq)
{
    if (sq->driver_state)
        vlink_wake(sq->driver_state);
}

static void
detach_link(struct serialqueue *sq)
{
    if (sq->driver_state)
        vlink_detach(sq->driver_state);
    sq->driver_state = NULL;
}

static int
receive_bytes(void *ctx, double now, const uint8_t *buf, size_t len)
{
    struct serialqueue *sq = ctx;
    int has_input;

    pthread_mutex_lock(&sq->lock);
    sqcore_input(&sq->core, now, buf, len);
    serialqueue__deliver(sq);
    has_input = !qfifo_is_empty(&sq->pulled);
    pthread_mutex_unlock(&sq->lock);
    return has_input;
}

static double
run_core(void *ctx, double now)
{
    struct serialqueue *sq = ctx;
    struct sqcore *c = &sq->core;
    double wake;

    pthread_mutex_lock(&sq->lock);
    wake = sqcore_run(c, now);
    if (c->out_len)
        vlink_write(sq->driver_state, VLINK_TO_MCU, now, c->out, c->out_len);
    c->out_len = 0;
    pthread_mutex_unlock(&sq->lock);
    return wake;
}

static const struct sqdriver virtual_driver = {
    .kick = kick_link, .stop = detach_link,
};

struct serialqueue *
serialqueue_open_virtual(struct hostclock *clock, struct vlink *link)
{
    struct serialqueue *sq = serialqueue__new(clock, &virtual_driver);
    struct vlink_host host = {
        .ctx = sq, .receive = receive_bytes, .run = run_core,
    };

    if (!sq)
        return NULL;
    sq->driver_state = link;
    vlink_attach(link, &host);
    return sq;
}
