/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two serial queues on sockets, with everything at once from many threads:
 * producers, pullers, clock updates, figures, and triggers between the two.
 * For the thread sanitizer: any data race is an error. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "serialqueue.h"
#include "trdispatch.h"

enum { N_LINKS = 2, N_PRODUCERS = 2, N_MESSAGES = 400, STATE = 20, OID = 3,
       SET_TIMEOUT = 21, TRIGGER = 22, LOG = 1 };

struct link {
    struct serialqueue *sq;
    int host_fd, mcu_fd;
    uint32_t n_logged, n_triggers, n_timeouts, n_acked;
    pthread_t mcu, puller, producers[N_PRODUCERS];
};

static struct link links[N_LINKS];

static void
write_block(int fd, uint8_t seq, const uint8_t *payload, size_t len)
{
    uint8_t block[MSGBLOCK_MAX];
    size_t size = msgblock_build(block, seq, payload, len);

    if (write(fd, block, size) != (ssize_t)size)
        abort();
}

static void
report_state(struct link *l, uint8_t seq, uint32_t clock)
{
    uint8_t payload[32], *p = payload;

    p = msgblock_put_int(p, STATE);
    p = msgblock_put_int(p, OID);
    p = msgblock_put_int(p, l != &links[0] || l->n_logged < N_MESSAGES);
    p = msgblock_put_int(p, 1);
    p = msgblock_put_int(p, clock);
    write_block(l->mcu_fd, seq, payload, (size_t)(p - payload));
}

/* Messages: command, two integers. */
static void
take_payload(struct link *l, const uint8_t *p, const uint8_t *end)
{
    while (p < end) {
        uint32_t command, first, second;
        if (msgblock_get_int(&p, end, &command)
            || msgblock_get_int(&p, end, &first)
            || msgblock_get_int(&p, end, &second))
            abort();
        l->n_logged += command == LOG;
        l->n_triggers += command == TRIGGER && first == OID && second == 7;
        l->n_timeouts += command == SET_TIMEOUT && first == OID;
    }
}

static void *
run_mcu(void *arg)
{
    struct link *l = arg;
    uint8_t buf[4096], expected = 9;
    size_t used = 0;
    uint32_t clock = 0;
    ssize_t count;

    while ((count = read(l->mcu_fd, buf + used, sizeof(buf) - used)) > 0) {
        int size;
        used += (size_t)count;
        while ((size = msgblock_check(buf, used)) != 0) {
            if (size > 0 && (buf[1] & 15) == expected) {
                expected = (expected + 1) & 15;
                take_payload(l, buf + 2, buf + size - 3);
                report_state(l, expected, clock += 1000);
            }
            if (size > 0)
                write_block(l->mcu_fd, expected, NULL, 0);
            used -= (size_t)abs(size);
            memmove(buf, buf + abs(size), used);
        }
    }
    return NULL;
}

static void *
run_producer(void *arg)
{
    struct link *l = arg;
    struct cmdqueue *cq = serialqueue_add_queue(l->sq);
    uint8_t data[3 * MSGBLOCK_VLQ_MAX], *p;

    for (uint32_t i = 0; i < N_MESSAGES; i++) {
        struct clockest ce = { 1e6, 0., 0, i };
        struct sqstats stats;
        p = msgblock_put_int(data, LOG);
        p = msgblock_put_int(p, i);
        p = msgblock_put_int(p, i);
        if (serialqueue_send(l->sq, cq, data, (size_t)(p - data), 0, i,
                             1 + i))
            abort();
        serialqueue_set_clockest(l->sq, &ce);
        serialqueue_get_stats(l->sq, &stats);
        if (serialqueue_check(l->sq))
            abort();
    }
    return NULL;
}

static void *
run_puller(void *arg)
{
    struct link *l = arg;
    struct qmsg *m;

    while (l->n_acked < N_PRODUCERS * N_MESSAGES) {
        m = serialqueue_pull(l->sq, 1);
        if (!m)
            abort();
        l->n_acked += m->notify_id != 0;
        qmsg_free(m);
    }
    return NULL;
}

static void
open_link(struct link *l)
{
    int fds[2];

    if (socketpair(AF_UNIX, SOCK_STREAM, 0, fds))
        abort();
    l->host_fd = fds[0];
    l->mcu_fd = fds[1];
    l->sq = serialqueue_open_fd(hostclock_get_real(), l->host_fd,
                                SERIALQUEUE_UART, 0);
    if (!l->sq)
        abort();
    pthread_create(&l->mcu, NULL, run_mcu, l);
}

static void
close_link(struct link *l)
{
    serialqueue_close(l->sq);
    shutdown(l->host_fd, SHUT_RDWR);
    pthread_join(l->mcu, NULL);
    serialqueue_free(l->sq);
    close(l->host_fd);
    close(l->mcu_fd);
}

static void
join_workers(struct link *l)
{
    for (int i = 0; i < N_PRODUCERS; i++)
        pthread_join(l->producers[i], NULL);
    pthread_join(l->puller, NULL);
}

int
main(void)
{
    struct trdispatch *td = trdispatch_new();
    struct trmember *members[N_LINKS];
    struct trmember_tags tags = { OID, SET_TIMEOUT, TRIGGER, STATE };

    for (int i = 0; i < N_LINKS; i++) {
        open_link(&links[i]);
        members[i] = trdispatch_add(
            td, links[i].sq, serialqueue_add_queue(links[i].sq), &tags);
        trmember_setup(members[i], 0, 5000, 1500);
    }
    trdispatch_arm(td, 7);
    for (int i = 0; i < N_LINKS; i++) {
        pthread_create(&links[i].puller, NULL, run_puller, &links[i]);
        for (int j = 0; j < N_PRODUCERS; j++)
            pthread_create(&links[i].producers[j], NULL, run_producer,
                           &links[i]);
    }
    for (int i = 0; i < N_LINKS; i++)
        join_workers(&links[i]);
    if (trdispatch_check(td))
        return 1;
    trdispatch_disarm(td);
    if (trdispatch_check(td))
        return 1;
    for (int i = 0; i < N_LINKS; i++)
        close_link(&links[i]);
    trdispatch_free(td);
    for (int i = 0; i < N_LINKS; i++) {
        struct link *l = &links[i];
        trmember_free(members[i]);
        printf("link %d: %u logged, %u acked, %u triggers, %u timeouts\n",
               i, l->n_logged, l->n_acked, l->n_triggers, l->n_timeouts);
        if (l->n_logged != N_PRODUCERS * N_MESSAGES
            || l->n_acked != N_PRODUCERS * N_MESSAGES)
            return 1;
    }
    return links[0].n_triggers || links[1].n_triggers > 1;
}
