/* SPDX-License-Identifier: GPL-3.0-or-later
 * Triggers shared by mcus.  See trdispatch.h. */
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "msgblock.h"
#include "trdispatch.h"

struct trmember {
    struct trmember *next;
    struct trdispatch *td;
    struct serialqueue *sq;
    struct cmdqueue *cq;
    struct trmember_tags tags;
    struct sqreader reader;
    uint64_t report_clock;      /* of the last report */
    uint64_t expire_clock;      /* what the mcu was told last */
    uint64_t expire_ticks, min_extend_ticks;
};

struct trdispatch {
    pthread_mutex_t lock;
    struct trmember *members;
    uint32_t reason;
    int is_armed, can_trigger;
};

struct trdispatch *
trdispatch_new(void)
{
    struct trdispatch *td = calloc(1, sizeof(*td));

    if (td)
        pthread_mutex_init(&td->lock, NULL);
    return td;
}

void
trdispatch_free(struct trdispatch *td)
{
    if (!td)
        return;
    trdispatch_disarm(td);
    pthread_mutex_destroy(&td->lock);
    free(td);
}

/* Send a command of two integers. */
static void
send_pair(struct trmember *tm, uint32_t tag, uint32_t value,
          uint64_t req_clock)
{
    uint8_t buf[3 * MSGBLOCK_VLQ_MAX], *p = buf;

    p = msgblock_put_int(p, tag);
    p = msgblock_put_int(p, tm->tags.oid);
    p = msgblock_put_int(p, value);
    serialqueue_send(tm->sq, tm->cq, buf, (size_t)(p - buf), 0, req_clock, 0);
}

/* The earliest of all last reports, in host time. */
static double
find_oldest_report(const struct trdispatch *td)
{
    double oldest = INFINITY;

    for (const struct trmember *tm = td->members; tm; tm = tm->next) {
        struct clockest ce;
        serialqueue_get_clockest(tm->sq, &ce);
        if (!clockest_is_known(&ce))
            return -INFINITY;
        oldest = fmin(oldest, clockest_time_at(&ce, tm->report_clock));
    }
    return oldest;
}

static void
extend_timeouts(struct trdispatch *td)
{
    double oldest = find_oldest_report(td);

    if (oldest == -INFINITY)
        return;
    for (struct trmember *tm = td->members; tm; tm = tm->next) {
        struct clockest ce;
        uint64_t expire;
        serialqueue_get_clockest(tm->sq, &ce);
        expire = clockest_clock_at(&ce, oldest) + tm->expire_ticks;
        if (expire < tm->expire_clock + tm->min_extend_ticks)
            continue;
        tm->expire_clock = expire;
        send_pair(tm, tm->tags.set_timeout, (uint32_t)expire, expire);
    }
}

static void
pass_on(struct trdispatch *td, const struct trmember *from)
{
    td->can_trigger = 0;
    for (struct trmember *tm = td->members; tm; tm = tm->next)
        if (tm != from)
            send_pair(tm, tm->tags.trigger, td->reason, 0);
}

static void
note_report(struct trmember *tm, uint32_t can_trigger, uint32_t clock32)
{
    struct trdispatch *td = tm->td;
    struct clockest ce;
    uint64_t clock;

    if (!can_trigger) {
        pass_on(td, tm);
        return;
    }
    serialqueue_get_clockest(tm->sq, &ce);
    clock = clockest_extend(&ce, clock32);
    if (clock <= tm->report_clock)
        return;
    tm->report_clock = clock;
    extend_timeouts(td);
}

/* trsync_state oid can_trigger trigger_reason clock */
static void
handle_state(void *ctx, const struct qmsg *m)
{
    struct trmember *tm = ctx;
    const uint8_t *p = m->data + tm->reader.prefix_len;
    const uint8_t *end = m->data + m->len;
    uint32_t can_trigger, reason, clock32;

    if (msgblock_get_int(&p, end, &can_trigger)
        || msgblock_get_int(&p, end, &reason)
        || msgblock_get_int(&p, end, &clock32))
        return;
    pthread_mutex_lock(&tm->td->lock);
    if (tm->td->can_trigger)
        note_report(tm, can_trigger, clock32);
    pthread_mutex_unlock(&tm->td->lock);
}

struct trmember *
trdispatch_add(struct trdispatch *td, struct serialqueue *sq,
               struct cmdqueue *cq, const struct trmember_tags *tags)
{
    struct trmember *tm = calloc(1, sizeof(*tm));
    uint8_t *end;

    if (!tm)
        return NULL;
    tm->td = td;
    tm->sq = sq;
    tm->cq = cq;
    tm->tags = *tags;
    end = msgblock_put_int(tm->reader.prefix, tags->state);
    end = msgblock_put_int(end, tags->oid);
    tm->reader.prefix_len = (uint8_t)(end - tm->reader.prefix);
    tm->reader.ctx = tm;
    tm->reader.handle = handle_state;
    pthread_mutex_lock(&td->lock);
    tm->next = td->members;
    td->members = tm;
    pthread_mutex_unlock(&td->lock);
    return tm;
}

void
trmember_free(struct trmember *tm)
{
    free(tm);
}

void
trmember_setup(struct trmember *tm, uint64_t clock, uint64_t expire_ticks,
               uint64_t min_extend_ticks)
{
    pthread_mutex_lock(&tm->td->lock);
    tm->report_clock = clock;
    tm->expire_clock = clock + expire_ticks;
    tm->expire_ticks = expire_ticks;
    tm->min_extend_ticks = min_extend_ticks;
    pthread_mutex_unlock(&tm->td->lock);
}

void
trdispatch_arm(struct trdispatch *td, uint32_t reason)
{
    trdispatch_disarm(td);
    pthread_mutex_lock(&td->lock);
    td->reason = reason;
    td->can_trigger = td->is_armed = 1;
    pthread_mutex_unlock(&td->lock);
    for (struct trmember *tm = td->members; tm; tm = tm->next)
        serialqueue_add_reader(tm->sq, &tm->reader);
}

void
trdispatch_disarm(struct trdispatch *td)
{
    int was_armed;

    pthread_mutex_lock(&td->lock);
    was_armed = td->is_armed;
    td->can_trigger = td->is_armed = 0;
    pthread_mutex_unlock(&td->lock);
    if (!was_armed)
        return;
    for (struct trmember *tm = td->members; tm; tm = tm->next)
        serialqueue_remove_reader(tm->sq, &tm->reader);
}

int
trdispatch_check(struct trdispatch *td)
{
    int ret = 0;

    pthread_mutex_lock(&td->lock);
    if (td->can_trigger && !td->is_armed)
        ret = -74;              /* nobody would hear of it */
    for (const struct trmember *tm = td->members; tm && !ret; tm = tm->next)
        if (tm->td != td || !tm->sq || !tm->cq)
            ret = -75;
    pthread_mutex_unlock(&td->lock);
    return ret;
}
