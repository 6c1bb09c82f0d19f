/* SPDX-License-Identifier: GPL-3.0-or-later
 * Serial queue into a file: every message at once, in the order it was sent.
 *
 * There is no thread: who sends fills blocks and a buffer of them, and writes
 * it when it is full.  close() writes the rest; the first failure is kept and told then. */
#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "serialqueue_internal.h"

enum { FILE_BUFFER = 65536 };

struct filesink {
    int fd;
    size_t used;                /* of buf: whole blocks */
    uint32_t n_payload;         /* of the block that is not full yet */
    uint8_t block[MSGBLOCK_MAX];
    uint8_t buf[FILE_BUFFER];
};

/* Wait for room when the descriptor does not block by itself. */
static int
write_some(int fd, const uint8_t *buf, size_t len)
{
    struct pollfd pfd = { .fd = fd, .events = POLLOUT };
    ssize_t count = write(fd, buf, len);

    if (count >= 0)
        return (int)count;
    if (errno == EINTR)
        return 0;
    if (errno != EAGAIN)
        return -errno;
    return poll(&pfd, 1, -1) < 0 && errno != EINTR ? -errno : 0;
}

static void
flush_file(struct serialqueue *sq, struct filesink *sink)
{
    size_t done = 0;

    while (done < sink->used && !sq->error) {
        int count = write_some(sink->fd, sink->buf + done, sink->used - done);
        if (count < 0)
            serialqueue__note_error(sq, count);
        else
            done += (size_t)count;
    }
    sink->used = 0;
}

/* Nobody acknowledges, so a message is done as soon as it is taken. */
static void
finish_waited(struct serialqueue *sq, struct qfifo *waited, double now)
{
    struct qmsg *m;

    for (m = waited->head; m; m = m->next) {
        m->len = 0;
        m->sent_time = m->receive_time = now;
    }
    if (waited->head) {
        qfifo_join(&sq->pulled, waited);
        pthread_cond_broadcast(&sq->arrived);
    }
}

static void
end_block(struct serialqueue *sq, struct filesink *sink)
{
    struct sqcore *c = &sq->core;
    size_t len = msgblock_build(sink->block, (uint8_t)c->send_seq,
                                sink->block + MSGBLOCK_HEADER,
                                sink->n_payload);

    if (sink->used + len > FILE_BUFFER)
        flush_file(sq, sink);
    memcpy(sink->buf + sink->used, sink->block, len);
    sink->used += len;
    sink->n_payload = 0;
    c->receive_seq = ++c->send_seq;
    c->bytes_write += len;
    sqhistory_note(&c->sent, hostclock_now(sq->clock), sink->block, len);
}

/* Called with whole batches, so that the file is the same on every run. */
static void
take_messages(struct serialqueue *sq)
{
    struct filesink *sink = sq->driver_state;
    struct qfifo waited;

    qfifo_init(&waited);
    cmdsched_release(&sq->core.sched, UINT64_MAX - 1);
    while (sq->core.sched.ready_bytes) {
        sink->n_payload += cmdsched_fill(
            &sq->core.sched, sink->block + MSGBLOCK_HEADER + sink->n_payload,
            MSGBLOCK_PAYLOAD_MAX - sink->n_payload, &waited);
        if (sq->core.sched.ready_bytes)
            end_block(sq, sink);
    }
    finish_waited(sq, &waited, hostclock_now(sq->clock));
}

static void
close_file(struct serialqueue *sq)
{
    struct filesink *sink = sq->driver_state;

    pthread_mutex_lock(&sq->lock);
    if (sink->n_payload)
        end_block(sq, sink);
    flush_file(sq, sink);
    sq->driver_state = NULL;
    pthread_mutex_unlock(&sq->lock);
    free(sink);
}

static const struct sqdriver file_driver = {
    .kick = take_messages, .stop = close_file,
};

struct serialqueue *
serialqueue_open_file(struct hostclock *clock, int fd)
{
    struct filesink *sink = malloc(sizeof(*sink));
    struct serialqueue *sq;

    if (!sink)
        return NULL;
    sink->fd = fd;
    sink->used = sink->n_payload = 0;
    sq = serialqueue__new(clock, &file_driver);
    if (!sq) {
        free(sink);
        return NULL;
    }
    sq->driver_state = sink;
    return sq;
}
