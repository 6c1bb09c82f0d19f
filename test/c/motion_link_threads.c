/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * All threads of a host at once: a planner, a pool that makes steps, a guard
 * that takes over, and two boards on sockets with I/O threads, pullers and
 * somebody who asks for figures.  Each board counts the steps it is told of:
 * at the end its motors are where the planner thinks.
 * Usage: motion_link_threads [rounds].
 */
#include <math.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "kin_delta.h"
#include "kin_linear.h"
#include "motionlock.h"
#include "serialqueue.h"
#include "stepguard.h"

enum { BOARDS = 2, MOTORS = 3, WORKERS = 2, QUEUE_STEP = 5, SET_DIR = 6 };

#define FREQ 16e6
#define STEP .01
#define SPEED 40.

struct board {
    struct serialqueue *sq;
    int host_fd, mcu_fd;
    pthread_t mcu, puller;
    struct steppersync *ss;
    struct stepcompress *sc[MOTORS];
    struct itersolve *is[MOTORS];
    double start[MOTORS];
    long position[MOTORS];
    int dir[MOTORS];
};

static struct board boards[BOARDS];
static struct trapq *tq;
static struct stepguard *guard;
static struct steppool *pool;
static double plan_end = 1., reached, place[3];
static long taken_over;
static atomic_int is_over;

static void
expect(int is_true, const char *what)
{
    if (is_true)
        return;
    fprintf(stderr, "not so: %s\n", what);
    exit(1);
}

/* ---- The board ---- */

static void
take_payload(struct board *b, const uint8_t *p, const uint8_t *end)
{
    while (p < end) {
        uint32_t tag, oid, value, count, add;
        expect(!msgblock_get_int(&p, end, &tag)
               && !msgblock_get_int(&p, end, &oid) && oid < MOTORS
               && !msgblock_get_int(&p, end, &value), "a message");
        if (tag == SET_DIR) {
            b->dir[oid] = value ? 1 : -1;
            continue;
        }
        expect(tag == QUEUE_STEP && !msgblock_get_int(&p, end, &count)
               && !msgblock_get_int(&p, end, &add), "steps");
        b->position[oid] += b->dir[oid] * (long)count;
    }
}

static void *
run_mcu(void *arg)
{
    struct board *b = arg;
    uint8_t buf[4096], expected = 5, block[MSGBLOCK_MAX];
    size_t used = 0;
    ssize_t count;
    int size;

    while ((count = read(b->mcu_fd, buf + used, sizeof(buf) - used)) > 0) {
        used += (size_t)count;
        while ((size = msgblock_check(buf, used)) != 0) {
            if (size > 0 && (buf[1] & 15) == expected) {
                expected = (expected + 1) & 15;
                take_payload(b, buf + MSGBLOCK_HEADER,
                             buf + size - MSGBLOCK_TRAILER);
            }
            if (size > 0) {
                size_t len = msgblock_build(block, expected, NULL, 0);
                expect(write(b->mcu_fd, block, len) == (ssize_t)len,
                       "the board answers");
            }
            used -= (size_t)abs(size);
            memmove(buf, buf + abs(size), used);
        }
    }
    return NULL;
}

static void *
run_puller(void *arg)
{
    struct board *b = arg;
    struct qmsg *m;

    while ((m = serialqueue_pull(b->sq, 1)) != NULL)
        qmsg_free(m);
    return NULL;
}

/* Asks all boards for figures, and tells them the time. */
static void *
run_asker(void *arg)
{
    (void)arg;
    while (!is_over) {
        for (int i = 0; i < BOARDS; i++) {
            struct clockest ce = {
                FREQ, 0., 0, (uint64_t)(FREQ * 1e6)
            };
            struct sqstats stats;
            ce.conv_clock = ce.last_clock;
            serialqueue_set_clockest(boards[i].sq, &ce);
            serialqueue_get_stats(boards[i].sq, &stats);
            expect(!serialqueue_check(boards[i].sq), "the queue holds");
        }
        sched_yield();
    }
    return NULL;
}

/* ---- Birth ---- */

static void
open_link(struct board *b)
{
    int fds[2];

    expect(!socketpair(AF_UNIX, SOCK_STREAM, 0, fds), "sockets");
    b->host_fd = fds[0];
    b->mcu_fd = fds[1];
    b->sq = serialqueue_open_fd(hostclock_get_real(), fds[0],
                                SERIALQUEUE_UART, 0);
    expect(b->sq != NULL, "a queue");
    pthread_create(&b->mcu, NULL, run_mcu, b);
    pthread_create(&b->puller, NULL, run_puller, b);
}

static void
build(struct board *b)
{
    struct stepcompress_options options = { 400, QUEUE_STEP, SET_DIR, 0 };
    struct cmdqueue *cq;

    open_link(b);
    cq = serialqueue_add_queue(b->sq);
    b->ss = steppersync_new(&cq->sink, 100);
    b->is[0] = &kin_linear_new(1., 1., 0.)->is;
    b->is[1] = &kin_linear_new(1., -1., 0.)->is;
    b->is[2] = &kin_delta_new(250. * 250., 130., 0.)->is;
    steppersync_set_time(b->ss, 0., FREQ);
    for (int i = 0; i < MOTORS; i++) {
        b->sc[i] = stepcompress_new((uint32_t)i);
        stepcompress_configure(b->sc[i], &options);
        itersolve_set_trapq(b->is[i], tq);
        itersolve_set_stepcompress(b->is[i], b->sc[i], STEP);
        itersolve_set_position(b->is[i], place);
        b->start[i] = itersolve_get_commanded_pos(b->is[i]);
        expect(steppersync_add(b->ss, b->sc[i], b->is[i]) >= 0, "a motor");
    }
    expect(!stepguard_add(guard, b->ss), "it is guarded");
}

/* ---- Motion ---- */

/* A round, or there and back along a line. */
static void
add_move(int i)
{
    double radius = 1. + i % 5, way = 2. * 3.14159265358979323846 * radius;
    struct trap_move move = {
        .cruise_t = way / SPEED, .axes_r = { 1., 0., 0. },
        .start_v = SPEED, .cruise_v = SPEED, .turn = 1. / radius,
        .normal = 2,
    };

    if (i % 2) {
        move.turn = 0.;
        move.axes_r[0] = i % 4 == 1 ? .01 : -.01;
    }
    memcpy(move.start, place, sizeof(place));
    if (i % 2)
        place[0] += way * move.axes_r[0];
    motionlock_take();
    expect(!trapq_add(tq, plan_end, &move), "there is memory");
    plan_end = tq->end_time;
    motionlock_give();
}

/* As the host does: threads make the steps, the planner sends them. */
static void
make_steps(double until)
{
    uint64_t clock = (uint64_t)(until * FREQ);

    for (int i = 0; i < BOARDS; i++)
        expect(!steppersync_start(boards[i].ss, pool, until, clock),
               "there is memory");
    steppool_start(pool);
    sched_yield();
    motionlock_take();
    for (int i = 0; i < BOARDS; i++)
        expect(!steppersync_finish(boards[i].ss)
               && !steppersync_flush(boards[i].ss, clock, 0),
               "steps are made and sent");
    trapq_finalize(tq, until - 1., until - 2.);
    motionlock_give();
    reached = until;
}

static void
go_away(void)
{
    double now = hostclock_now(hostclock_get_real());
    struct stepguard_plan plan = {
        .reached = reached, .certain = plan_end - .1, .end = plan_end,
        .deadline = now - 10., .slack = 1e6,
    };

    if (plan.end > plan.reached)
        stepguard_arm(guard, &plan);
}

static void
come_back(void)
{
    struct stepguard_result result = stepguard_disarm(guard);

    if (!result.is_armed)
        return;
    expect(!result.error, "the guard makes steps");
    taken_over += result.reached > reached;
    reached = fmax(reached, result.reached);
}

static void
print_rounds(int rounds)
{
    for (int i = 0; i < rounds; i++) {
        add_move(i);
        if (plan_end - .2 > reached)
            make_steps(plan_end - .2);
        if (i % 4 == 3)
            go_away();
        for (int k = 0; k < i % 7; k++)
            sched_yield();
        come_back();
    }
    while (reached < plan_end) {
        go_away();
        sched_yield();
        come_back();
    }
    motionlock_take();
    for (int i = 0; i < BOARDS; i++)
        expect(!steppersync_flush(boards[i].ss, UINT64_MAX / 4, 0),
               "all is sent");
    motionlock_give();
}

/* ---- Death ---- */

static void
wait_for_link(struct board *b)
{
    struct sqstats stats;

    do {
        sched_yield();
        serialqueue_get_stats(b->sq, &stats);
    } while (stats.ready_bytes || stats.upcoming_bytes
             || stats.send_seq != stats.receive_seq);
}

static void
destroy(struct board *b)
{
    wait_for_link(b);
    serialqueue_close(b->sq);
    shutdown(b->host_fd, SHUT_RDWR);
    pthread_join(b->mcu, NULL);
    pthread_join(b->puller, NULL);
    for (int i = 0; i < MOTORS; i++) {
        double way = itersolve_get_commanded_pos(b->is[i]) - b->start[i];
        expect(b->position[i] == lround(way / STEP), "no step is lost");
    }
    steppersync_delete(b->ss);
    for (int i = 0; i < MOTORS; i++) {
        stepcompress_delete(b->sc[i]);
        free(b->is[i]);
    }
    serialqueue_free(b->sq);
    close(b->host_fd);
    close(b->mcu_fd);
}

int
main(int argc, char **argv)
{
    int rounds = argc > 1 ? atoi(argv[1]) : 100;
    pthread_t asker;

    tq = trapq_new();
    pool = steppool_new(WORKERS);
    guard = stepguard_new(hostclock_get_real());
    expect(tq && pool && guard && !stepguard_start(guard), "a host");
    for (int i = 0; i < BOARDS; i++)
        build(&boards[i]);
    pthread_create(&asker, NULL, run_asker, NULL);
    print_rounds(rounds);
    is_over = 1;
    pthread_join(asker, NULL);
    stepguard_free(guard);
    for (int i = 0; i < BOARDS; i++)
        destroy(&boards[i]);
    steppool_delete(pool);
    trapq_delete(tq);
    printf("%d rounds, guarded %ld times\n", rounds, taken_over);
    return 0;
}
