/* SPDX-License-Identifier: GPL-3.0-or-later
 * Step pulses from queued runs of steps.
 *
 * Four kinds of timer event make the pulses:
 *   edge    the driver steps on both edges: one toggle a step
 *   inline  pulse and planning in one event, where that takes long enough
 *   short   inline, of a run whose intervals need but 16 bits: for 8 bit cpus
 *   phased  one event for each edge, for pulses (or, with a driver that steps
 *           on both edges, pauses) of any length
 * All share advance(), which finds the time of the next step.  The direction
 * pin changes in advance(), after the last pulse of the run before.
 */
#include <stdbool.h>
#include <stddef.h>

#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/arena.h"
#include "core/oid.h"
#include "core/sched.h"
#include "motion/stepper.h"
#include "motion/trsync.h"

DECL_CONSTANT("STEPPER_STEP_BOTH_EDGE", 1);
DECL_CONSTANT("STEPPER_OPTIMIZED_EDGE", STEPPER_EDGE_TICKS);
#if CONFIG_HAVE_STEP_PULSE_INLINE
DECL_CONSTANT("STEPPER_OPTIMIZED_UNSTEP", STEPPER_INLINE_TICKS);
#endif

struct run {
    struct run *next;
    uint32_t interval;
    int16_t add;
    uint16_t count;
    uint8_t dir;          /* level of the direction pin, and RUN_SHORT */
};

/* No interval is above 16 bits: the event of such runs does for this one. */
#define RUN_SHORT 2

/* The fields that events use come first: within reach of short loads. */
struct stepper {
    struct timer timer;
    uint32_t interval;
    stepper_add_t add;
    stepper_count_t count; /* steps left of the current run; 0: idle */
    struct gpio_out step_pin;
    uint8_t dir;          /* level of the direction pin */
    struct run *first;
    struct gpio_out dir_pin;
    struct run *last;
    bool is_high;         /* within a pulse, after the event that began it */
    bool needs_reset;     /* stopped: ignore runs until reset_step_clock */
    uint8_t next_dir;     /* of runs still to be queued */
    uint32_t step_clock;  /* phased: time of the next step */
    uint32_t pulse_ticks;
    uint32_t end_position; /* after all runs, in steps */
    uint8_t idle_level;   /* of the step pin between pulses */
    bool is_edge;         /* steps on both edges */
    bool is_inline;
    struct trsync_signal stop_signal;
};

static const ROM struct oid_kind stepper_kind = { sizeof(struct stepper) };


/* ---- Timer events ---- */

#if CONFIG_HAVE_SHORT_STEPS

/* RUN_SHORT if it applies, from the command. */
static uint8_t check_short(uint32_t interval, int16_t add, uint16_t count)
{
    int32_t last = (int32_t)interval + (int32_t)add * (count - 1);

    return interval <= UINT16_MAX && last >= 0 && last <= UINT16_MAX
        ? RUN_SHORT : 0;
}
#else
#define check_short(INTERVAL, ADD, COUNT) 0
#endif

/* The run that begins at *clock: move it to the first step's time.  Returns
 * false when there is none.  Out of line, so that the common path saves no
 * registers for it. */
static __attribute__((noinline)) bool next_run(struct stepper *s,
                                               uint32_t *clock)
{
    struct run *run = s->first;
    uint32_t interval;
    int16_t add;

    if (!run)
        return false;
    s->first = run->next;
    interval = run->interval;
    *clock += interval;
    s->add = add = run->add;
    s->interval = interval + (uint32_t)(int32_t)add;
    s->count = run->count;
    if ((run->dir ^ s->dir) & 1) {
        s->dir = run->dir & 1;
        gpio_toggle_irq(s->dir_pin);
    }
#if CONFIG_HAVE_SHORT_STEPS
    if (s->is_inline)
        s->timer.event = run->dir & RUN_SHORT ? stepper_short_event
                                               : stepper_inline_event;
#endif
    movecell_give(run);
    return true;
}

/* The step at *clock is done: move *clock to the next one's time.  Returns
 * false when no steps are left. */
static inline bool advance(struct stepper *s, uint32_t *clock)
{
    uint32_t interval = s->interval;

    if (!--s->count)
        return next_run(s, clock);
    *clock += interval;
    s->interval = interval + (uint32_t)(int32_t)s->add;
    return true;
}

#if CONFIG_HAVE_EDGE_STEPS
_Static_assert(offsetof(struct stepper, interval)
                   == offsetof(struct stepper_head, interval)
               && offsetof(struct stepper, add)
                   == offsetof(struct stepper_head, add)
               && offsetof(struct stepper, count)
                   == offsetof(struct stepper_head, count)
               && offsetof(struct stepper, step_pin)
                   == offsetof(struct stepper_head, step_pin),
               "the timer interrupt knows these");
#endif

bool stepper_edge_event(struct timer *timer)
{
    struct stepper *s = CONTAINER_OF(timer, struct stepper, timer);

    gpio_toggle_irq(s->step_pin);
    return advance(s, &timer->waketime);
}

#if CONFIG_HAVE_STEP_PULSE_INLINE
bool stepper_inline_event(struct timer *timer)
{
    struct stepper *s = CONTAINER_OF(timer, struct stepper, timer);
    bool again;

    gpio_toggle_irq(s->step_pin);
    again = advance(s, &timer->waketime);
    gpio_toggle_irq(s->step_pin);
    return again;
}
#endif

#if CONFIG_HAVE_SHORT_STEPS
typedef uint16_t __attribute__((may_alias)) half_t;

static inline void advance_short(struct stepper *s, uint16_t interval,
                                 int16_t add)
{
    half_t *clock = (half_t *)&s->timer.waketime;
    uint16_t low = (uint16_t)(clock[0] + interval);

    clock[0] = low;
    if (low < interval)
        clock[1]++;
    *(half_t *)&s->interval = (uint16_t)(interval + (uint16_t)add);
}

_Static_assert(offsetof(struct stepper, interval) == STEPPER_AT_INTERVAL
               && offsetof(struct stepper, add) == STEPPER_AT_ADD
               && offsetof(struct stepper, count) == STEPPER_AT_COUNT
               && offsetof(struct stepper, step_pin) == STEPPER_AT_PORT
               && offsetof(struct stepper, dir) == STEPPER_AT_DIR
               && offsetof(struct stepper, first) == STEPPER_AT_RUNS
               && offsetof(struct stepper, dir_pin) == STEPPER_AT_DIR_PORT
               && offsetof(struct stepper, is_high) == STEPPER_AT_HIGH
               && offsetof(struct run, interval) == RUN_AT_INTERVAL
               && offsetof(struct run, add) == RUN_AT_ADD
               && offsetof(struct run, count) == RUN_AT_COUNT
               && offsetof(struct run, dir) == RUN_AT_DIR && RUN_SHORT == 2,
               "the timer interrupt knows these");

bool stepper_short_event(struct timer *timer)
{
    struct stepper *s = CONTAINER_OF(timer, struct stepper, timer);
    struct gpio_out pin = s->step_pin;
    bool again = TIMER_AGAIN;

    gpio_toggle_irq(pin);
    if (--s->count)
        advance_short(s, *(half_t *)&s->interval, s->add);
    else
        again = next_run(s, &timer->waketime);
    gpio_toggle_irq(pin);
    return again;
}

static bool end_pulse(struct timer *timer, bool (*event)(struct timer *timer))
{
    struct stepper *s = CONTAINER_OF(timer, struct stepper, timer);
    bool again;

    s->is_high = false;
    timer->event = event;
    again = advance(s, &timer->waketime);
    gpio_toggle_irq(s->step_pin);
    return again;
}

bool stepper_short_pulsed(struct timer *timer)
{
    return end_pulse(timer, stepper_short_event);
}

bool stepper_inline_pulsed(struct timer *timer)
{
    return end_pulse(timer, stepper_inline_event);
}
#endif

/* Wake at the next step, but leave the pin low for a pulse's length. */
static bool plan_rise(struct stepper *s, uint32_t now)
{
    uint32_t earliest = now + s->pulse_ticks;

    if (timer_is_before(s->step_clock, earliest)) {
        if (now - s->step_clock < UINT32_C(1) << 31
            && now - s->step_clock > timer_from_us(STEPPER_MAX_LAG_US))
            shutdown("Stepper too far in past");
        s->timer.waketime = earliest;
    } else {
        s->timer.waketime = s->step_clock;
    }
    return TIMER_AGAIN;
}

static bool phased_event(struct timer *timer)
{
    struct stepper *s = CONTAINER_OF(timer, struct stepper, timer);
    uint32_t now = timer_read_clock();

    gpio_toggle_irq(s->step_pin);
    s->is_high = !s->is_high && !s->is_edge;
    if (s->is_high) {
        timer->waketime = now + s->pulse_ticks;
        return TIMER_AGAIN;
    }
    if (!advance(s, &s->step_clock))
        return TIMER_DONE;
    return plan_rise(s, now);
}


/* ---- Starting and stopping ---- */

/* Idle, a run is queued: start with its first step.  Nothing else may touch the
 * motor meanwhile. */
static void start(struct stepper *s)
{
    uint32_t *clock = s->pulse_ticks ? &s->step_clock : &s->timer.waketime;

    s->count = 1;
    advance(s, clock);
    s->timer.waketime = *clock;
    sched_add_step(&s->timer);
}

/* Irqs off, and on behind it if steps interrupt other events: nothing else
 * touches an idle motor then, so other motors need not wait. */
static void start_unlocked(struct stepper *s)
{
    irq_flag_t flag = sched_lock_events();

    if (CONFIG_HAVE_SLOW_EVENTS)
        irq_enable();
    start(s);
    sched_unlock_events(flag);
}

static void drop_runs(struct stepper *s)
{
    while (s->first) {
        struct run *run = s->first;
        s->first = run->next;
        movecell_give(run);
    }
}

static inline uint32_t go_back(uint32_t position, bool dir, uint32_t count)
{
    return dir ? position - count : position + count;
}

/* Irqs off: position after the steps made so far. */
static uint32_t get_position(const struct stepper *s)
{
    uint32_t position = s->end_position;
    uint16_t left = (uint16_t)s->count;
    const struct run *run;

    for (run = s->first; run; run = run->next)
        position = go_back(position, run->dir & 1, run->count);
    if (left && s->is_high)
        left--;
    return go_back(position, s->dir, left);
}

/* Irqs off: no more steps; the rest of the queue is forgotten. */
static void stop(struct stepper *s)
{
    sched_del_step(&s->timer);
    s->end_position = get_position(s);
    s->count = 0;
    s->is_high = false;
    s->next_dir = s->dir;
    s->needs_reset = true;
    if (!s->is_edge)
        gpio_write(s->step_pin, s->idle_level);
    drop_runs(s);
}

static void stop_on_trigger(struct trsync_signal *signal, uint8_t reason)
{
    (void)reason;
    stop(CONTAINER_OF(signal, struct stepper, stop_signal));
}

void stepper_shutdown(void)
{
    struct stepper *s;
    int16_t oid = -1;

    while ((s = oid_next(&oid, &stepper_kind))) {
        uint32_t position = get_position(s);

        s->first = NULL;
        s->stop_signal.on_trigger = NULL;
        stop(s);
        s->end_position = position;
    }
}
DECL_SHUTDOWN(stepper_shutdown);


/* ---- Commands ---- */

static void choose_event(struct stepper *s, uint32_t pulse_ticks)
{
    s->timer.event = phased_event;
    s->pulse_ticks = pulse_ticks ? pulse_ticks : 1;
    if (s->is_edge && pulse_ticks <= STEPPER_EDGE_TICKS) {
        s->timer.event = stepper_edge_event;
        s->pulse_ticks = 0;
    }
#if CONFIG_HAVE_STEP_PULSE_INLINE
    if (!s->is_edge && pulse_ticks <= STEPPER_INLINE_TICKS) {
        s->timer.event = stepper_inline_event;
        s->is_inline = true;
        s->pulse_ticks = 0;
    }
#endif
}

/* invert_step: 0, 1, or -1 for a driver that steps on both edges. */
void command_config_stepper(const struct args_config_stepper *args)
{
    int8_t invert = (int8_t)args->invert_step;
    struct gpio_out step_pin = gpio_setup_output(args->step_pin, invert > 0);
    struct gpio_out dir_pin = gpio_setup_output(args->dir_pin, 0);
    struct stepper *s = oid_new(args->oid, &stepper_kind);

    s->is_edge = invert < 0;
    s->idle_level = invert > 0;
    s->step_pin = step_pin;
    s->dir_pin = dir_pin;
    choose_event(s, args->step_pulse_ticks);
    movecell_request(sizeof(struct run));
}
DECL_COMMAND(command_config_stepper,
             "config_stepper oid=%c step_pin=%c dir_pin=%c invert_step=%c"
             " step_pulse_ticks=%u");

static struct stepper *stepper_lookup(uint8_t oid)
{
    return oid_lookup(oid, &stepper_kind);
}

void command_queue_step(const struct args_queue_step *args)
{
    struct stepper *s = stepper_lookup(args->oid);
    struct run *run;

    if (!args->count)
        shutdown("Invalid count parameter");
    run = movecell_take();
    run->next = NULL;
    run->interval = args->interval;
    run->count = args->count;
    run->add = args->add;
    run->dir = (uint8_t)(s->next_dir
                         | check_short(args->interval, args->add, args->count));
    irq_disable();
    if (s->needs_reset) {
        movecell_give(run);
    } else {
        s->end_position = go_back(s->end_position, !(run->dir & 1), run->count);
        if (s->first)
            s->last->next = run;
        else
            s->first = run;
        s->last = run;
        if (!s->count)
            start_unlocked(s);
    }
    irq_enable();
}
DECL_COMMAND(command_queue_step,
             "queue_step oid=%c interval=%u count=%hu add=%hi");

void command_set_next_step_dir(const struct args_set_next_step_dir *args)
{
    struct stepper *s = stepper_lookup(args->oid);

    irq_disable();
    s->next_dir = args->dir != 0;
    irq_enable();
}
DECL_COMMAND(command_set_next_step_dir, "set_next_step_dir oid=%c dir=%c");

/* The next run's interval counts from this clock. */
void command_reset_step_clock(const struct args_reset_step_clock *args)
{
    struct stepper *s = stepper_lookup(args->oid);

    irq_disable();
    if (s->count)
        shutdown("Can't reset time when stepper active");
    s->timer.waketime = s->step_clock = args->clock;
    s->needs_reset = false;
    irq_enable();
}
DECL_COMMAND(command_reset_step_clock, "reset_step_clock oid=%c clock=%u");

void command_stepper_get_position(const struct args_stepper_get_position *args)
{
    struct stepper *s = stepper_lookup(args->oid);
    uint32_t position;

    irq_disable();
    position = get_position(s);
    irq_enable();
    sendf("stepper_position oid=%c pos=%i", args->oid, (int32_t)position);
}
DECL_COMMAND(command_stepper_get_position, "stepper_get_position oid=%c");

void command_stepper_stop_on_trigger(
    const struct args_stepper_stop_on_trigger *args)
{
    struct stepper *s = stepper_lookup(args->oid);
    struct trsync *ts = trsync_lookup(args->trsync_oid);

    trsync_add_signal(ts, &s->stop_signal, stop_on_trigger);
}
DECL_COMMAND(command_stepper_stop_on_trigger,
             "stepper_stop_on_trigger oid=%c trsync_oid=%c");
