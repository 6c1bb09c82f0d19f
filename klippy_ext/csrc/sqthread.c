/* SPDX-License-Identifier: GPL-3.0-or-later
 * Serial queue on a descriptor: an I/O thread that sleeps in ppoll.
 *
 * The thread holds the queue's lock except while it sleeps and while readers
 * run.  A link that fails is read no more; pullers get to know at once. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <linux/can.h>
#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "realtime.h"
#include "serialqueue_internal.h"

enum { READ_SIZE = 4096, POLL_FD = 0, POLL_WAKE = 1 };
#define WAIT_MAX 3600.

struct iothread {
    pthread_t thread;
    int fd, wake_fd;
    enum serialqueue_kind kind;
    uint32_t client_id;
};

static void
kick_thread(struct serialqueue *sq)
{
    struct iothread *io = sq->driver_state;
    uint64_t one = 1;

    if (io && write(io->wake_fd, &one, sizeof(one)) < 0 && errno != EAGAIN)
        serialqueue__note_error(sq, -errno);
}

static int
is_transient(int error)
{
    return error == EAGAIN || error == EINTR || error == ENOBUFS;
}

/* Write one CAN frame.  Returns the bytes of it that count, or -1. */
static ssize_t
write_can(const struct iothread *io, const uint8_t *buf, size_t len)
{
    struct can_frame frame = { .can_id = io->client_id };
    size_t count = len < sizeof(frame.data) ? len : sizeof(frame.data);

    frame.can_dlc = (uint8_t)count;
    memcpy(frame.data, buf, count);
    if (write(io->fd, &frame, sizeof(frame)) < 0)
        return -1;
    return (ssize_t)count;
}

static void
write_out(struct serialqueue *sq, struct iothread *io)
{
    struct sqcore *c = &sq->core;
    uint32_t done = 0;

    while (done < c->out_len && !sq->error) {
        const uint8_t *buf = c->out + done;
        ssize_t count = io->kind == SERIALQUEUE_CAN
            ? write_can(io, buf, c->out_len - done)
            : write(io->fd, buf, c->out_len - done);
        if (count < 0) {
            if (!is_transient(errno))
                serialqueue__note_error(sq, -errno);
            break;
        }
        done += (uint32_t)count;
    }
    c->out_len -= done;
    memmove(c->out, c->out + done, c->out_len);
}

/* Read what is there.  Returns the number of bytes, 0 if none count, or a
 * negative errno. */
static ssize_t
read_some(const struct iothread *io, uint8_t *buf)
{
    struct can_frame frame;
    ssize_t count;

    if (io->kind != SERIALQUEUE_CAN) {
        count = read(io->fd, buf, READ_SIZE);
        if (count < 0)
            return is_transient(errno) ? 0 : -errno;
        return count ? count : -EPIPE;
    }
    count = read(io->fd, &frame, sizeof(frame));
    if (count < 0)
        return is_transient(errno) ? 0 : -errno;
    if (count != sizeof(frame) || frame.can_id != io->client_id + 1
        || frame.can_dlc > sizeof(frame.data))
        return 0;
    memcpy(buf, frame.data, frame.can_dlc);
    return frame.can_dlc;
}

static void
read_in(struct serialqueue *sq, struct iothread *io)
{
    uint8_t buf[READ_SIZE];
    ssize_t count = read_some(io, buf);

    if (count > 0)
        sqcore_input(&sq->core, hostclock_now(sq->clock), buf,
                     (size_t)count);
    else if (count < 0)
        serialqueue__note_error(sq, (int)count);
    serialqueue__deliver(sq);
}

/* Sleep until `wake` (s), input, room for output or a kick. */
static void
sleep_until(struct serialqueue *sq, struct iothread *io, double wake)
{
    double delay = fmin(wake - hostclock_now(sq->clock), WAIT_MAX);
    struct timespec ts = { 0 };
    struct pollfd fds[2] = {
        [POLL_FD] = { .fd = sq->error ? -1 : io->fd, .events = POLLIN },
        [POLL_WAKE] = { .fd = io->wake_fd, .events = POLLIN },
    };
    uint64_t kicks;

    if (sq->core.out_len)
        fds[POLL_FD].events |= POLLOUT;
    if (delay > 0.) {
        ts.tv_sec = (time_t)delay;
        ts.tv_nsec = (long)((delay - floor(delay)) * 1e9);
    }
    pthread_mutex_unlock(&sq->lock);
    if (ppoll(fds, 2, &ts, NULL) < 0)
        fds[POLL_FD].revents = fds[POLL_WAKE].revents = 0;
    if (fds[POLL_WAKE].revents && read(io->wake_fd, &kicks, sizeof(kicks)) < 0)
        fds[POLL_WAKE].revents = 0;
    pthread_mutex_lock(&sq->lock);
    if (fds[POLL_FD].revents & (POLLIN | POLLHUP | POLLERR | POLLNVAL))
        read_in(sq, io);
}

static void *
run_thread(void *arg)
{
    struct serialqueue *sq = arg;
    struct iothread *io = sq->driver_state;

    realtime_raise_thread();
    pthread_mutex_lock(&sq->lock);
    while (!sq->is_closed) {
        double wake = sq->error ? INFINITY
            : sqcore_run(&sq->core, hostclock_now(sq->clock));
        if (!sq->error)
            write_out(sq, io);
        sleep_until(sq, io, wake);
    }
    pthread_mutex_unlock(&sq->lock);
    return NULL;
}

static void
stop_thread(struct serialqueue *sq)
{
    struct iothread *io = sq->driver_state;

    if (!io)
        return;
    pthread_join(io->thread, NULL);
    pthread_mutex_lock(&sq->lock);
    sq->driver_state = NULL;
    pthread_mutex_unlock(&sq->lock);
    close(io->wake_fd);
    free(io);
}

static const struct sqdriver thread_driver = {
    .kick = kick_thread, .stop = stop_thread,
};

static struct iothread *
make_iothread(int fd, enum serialqueue_kind kind, uint32_t client_id)
{
    struct iothread *io;
    int flags = fcntl(fd, F_GETFL);

    if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) < 0)
        return NULL;
    io = calloc(1, sizeof(*io));
    if (!io)
        return NULL;
    io->fd = fd;
    io->kind = kind;
    io->client_id = client_id;
    io->wake_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (io->wake_fd < 0) {
        free(io);
        return NULL;
    }
    return io;
}

struct serialqueue *
serialqueue_open_fd(struct hostclock *clock, int fd,
                    enum serialqueue_kind kind, uint32_t client_id)
{
    struct iothread *io = make_iothread(fd, kind, client_id);
    struct serialqueue *sq;
    int error;

    if (!io)
        return NULL;
    sq = serialqueue__new(clock, &thread_driver);
    if (sq) {
        sq->driver_state = io;
        error = pthread_create(&io->thread, NULL, run_thread, sq);
        if (!error)
            return sq;
        sq->driver_state = NULL;
        serialqueue_free(sq);
        errno = error;
    }
    close(io->wake_fd);
    free(io);
    return NULL;
}
