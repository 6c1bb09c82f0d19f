/* SPDX-License-Identifier: GPL-3.0-or-later
 * Timers against a slow model: the next to run is the earliest, of equal ones
 * the one added first; across the wrap of the clock, and after idle rounds. */
#include <string.h>

#include "board/timer.h"
#include "core/sched.h"
#include "fakeboard.h"
#include "tests.h"

enum { N_TIMERS = 40, N_STEPS = 20000, N_IDLE = 40 };

struct probe {
    struct timer timer;
    uint32_t order;    /* when it was added */
    uint32_t again;    /* ticks to its next run, 0: none */
    bool is_waiting;
};

static struct probe probes[N_TIMERS];
static struct probe *ran;
static uint32_t n_added;

static bool probe_event(struct timer *timer)
{
    struct probe *p = CONTAINER_OF(timer, struct probe, timer);

    ran = p;
    p->is_waiting = p->again != 0;
    p->order = n_added++;
    timer->waketime += p->again;
    return p->again ? TIMER_AGAIN : TIMER_DONE;
}

static struct probe *find_first(void)
{
    struct probe *first = NULL;

    for (int i = 0; i < N_TIMERS; i++) {
        struct probe *p = &probes[i];
        int32_t ticks;
        if (!p->is_waiting)
            continue;
        ticks = first ? (int32_t)(p->timer.waketime - first->timer.waketime)
                      : -1;
        if (ticks < 0 || (!ticks && p->order < first->order))
            first = p;
    }
    return first;
}

/* The interrupt comes for the first of those that wait. */
static void check_timer(void)
{
    const struct probe *first = find_first();

    CHECK(!first || fake.timer == first->timer.waketime);
}

static void add_probe(struct probe *p, uint32_t *seed)
{
    p->timer.event = probe_event;
    p->timer.waketime = fake.clock + next_random(seed) % 5000
        + (next_random(seed) % 20 ? 0 : 1u << 30);
    p->again = next_random(seed) % 3 ? 0 : next_random(seed) % 4000;
    p->order = n_added++;
    p->is_waiting = true;
    sched_add_timer(&p->timer);
    check_timer();
}

static void run_one(void)
{
    struct probe *expected = find_first();
    uint32_t due = expected ? expected->timer.waketime : 0;

    if (!expected)
        return;
    CHECK(fake.timer == due);
    CHECK(!timer_is_before(due, fake.clock));
    fake.clock = due;
    ran = NULL;
    fake.timer = sched_run_timer();
    CHECK(ran == expected);
}

/* Nothing waits for more than two rounds of the clock: whatever wakes the
 * board then is ahead of it, each time, and a timer is still the first. */
static void stay_idle(uint32_t *seed)
{
    for (int i = 0; i < N_TIMERS; i++)
        if (probes[i].is_waiting) {
            sched_del_timer(&probes[i].timer);
            probes[i].is_waiting = false;
        }
    for (int i = 0; i < N_IDLE; i++) {
        CHECK(timer_is_before(fake.clock, fake.timer));
        fake.clock = fake.timer;
        fake.timer = sched_run_timer();
    }
    CHECK(timer_is_before(fake.clock, fake.timer));
    add_probe(&probes[0], seed);
    run_one();
}

void test_sched(uint32_t seed)
{
    fake.clock = UINT32_MAX - 100000;
    for (int i = 0; i < N_STEPS; i++) {
        struct probe *p = &probes[next_random(&seed) % N_TIMERS];
        uint32_t action = next_random(&seed) % 4;
        if (action == 0 && p->is_waiting) {
            sched_del_timer(&p->timer);
            p->is_waiting = false;
            check_timer();
        } else if (action <= 1 && !p->is_waiting) {
            add_probe(p, &seed);
        } else {
            run_one();
        }
    }
    stay_idle(&seed);
    printf("sched: %u timers ran in order\n", n_added);
}
