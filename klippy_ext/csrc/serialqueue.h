/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Serial queue: sends commands to one mcu in the order their clocks demand,
 * exactly once, and collects what the mcu says.
 *
 * Three drivers run the same protocol core: a thread on a descriptor (serial
 * port, pty, socket, CAN), a link of a virtual world, and a plain file that
 * takes all messages and answers nothing.
 *
 * Threads: every function may be called from any thread on a descriptor; on a
 * virtual link from the world's thread only.  Readers run on the I/O thread
 * without the queue's lock held, so they may send to any queue.  Lock order:
 * reader_lock before lock.
 */
#ifndef SERIALQUEUE_H
#define SERIALQUEUE_H

#include "hostclock.h"
#include "qmsg.h"
#include "sqcore.h"

enum serialqueue_kind { SERIALQUEUE_UART, SERIALQUEUE_CAN };

struct serialqueue;
struct vlink;

/* Sees each received message that starts with `prefix`, before pull(). */
struct sqreader {
    struct sqreader *next;
    void *ctx;
    void (*handle)(void *ctx, const struct qmsg *m);
    uint8_t prefix[2 * MSGBLOCK_VLQ_MAX];
    uint8_t prefix_len;
};

/* Start an I/O thread on fd, which stays the caller's and becomes
 * non-blocking.  NULL on failure, with errno set. */
struct serialqueue *serialqueue_open_fd(struct hostclock *clock, int fd,
                                        enum serialqueue_kind kind,
                                        uint32_t client_id);
struct serialqueue *serialqueue_open_file(struct hostclock *clock, int fd);
struct serialqueue *serialqueue_open_virtual(struct hostclock *clock,
                                             struct vlink *link);
/* Stop I/O and wake pullers; a file gets all it was sent.  Returns 0 or the
 * negative errno of the first read or write that failed.  May be repeated. */
int serialqueue_close(struct serialqueue *sq);
void serialqueue_free(struct serialqueue *sq);

struct cmdqueue *serialqueue_add_queue(struct serialqueue *sq);
/* Queue a chain; empties it. */
void serialqueue_send_batch(struct serialqueue *sq, struct cmdqueue *cq,
                            struct qfifo *batch);
/* Queue one message.  Returns 0, -EINVAL or -ENOMEM. */
int serialqueue_send(struct serialqueue *sq, struct cmdqueue *cq,
                     const uint8_t *data, size_t len, uint64_t min_clock,
                     uint64_t req_clock, uint64_t notify_id);
/* Next received message or completion, the caller's to free; NULL when there
 * is none (wait false) or the queue is closed.  One with neither payload nor
 * notify_id says that there was no memory, and messages of the mcu are lost. */
struct qmsg *serialqueue_pull(struct serialqueue *sq, int wait);
int serialqueue_has_input(struct serialqueue *sq);

void serialqueue_add_reader(struct serialqueue *sq, struct sqreader *r);
/* After this the reader is not running and will not run. */
void serialqueue_remove_reader(struct serialqueue *sq, struct sqreader *r);

void serialqueue_set_byte_time(struct serialqueue *sq, double byte_time);
void serialqueue_set_receive_window(struct serialqueue *sq, uint32_t bytes);
void serialqueue_set_clockest(struct serialqueue *sq,
                              const struct clockest *ce);
void serialqueue_get_clockest(struct serialqueue *sq, struct clockest *ce);
void serialqueue_get_stats(struct serialqueue *sq, struct sqstats *stats);
/* Copy both histories, oldest first.  Each array has room for
 * SQCORE_HISTORY records. */
void serialqueue_get_history(struct serialqueue *sq, struct sqrecord *sent,
                             size_t *n_sent, struct sqrecord *received,
                             size_t *n_received);
/* Negative errno of the link, 0 while it works. */
int serialqueue_get_error(struct serialqueue *sq);
/* Verify the invariants: 0 if they hold. */
int serialqueue_check(struct serialqueue *sq);

#endif
