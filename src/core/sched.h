/* SPDX-License-Identifier: GPL-3.0-or-later
 * Tasks, timers and shutdown.
 *
 * Timers wait in one list in order of time.  The last entry is a sentinel that
 * always lies beyond all others, so the list is never empty.
 */
#ifndef CORE_SCHED_H
#define CORE_SCHED_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "board/irq.h"
#include "core/decl.h"

/* The object that a member belongs to. */
#define CONTAINER_OF(PTR, TYPE, MEMBER) \
    ((TYPE *)(void *)((char *)(PTR) - offsetof(TYPE, MEMBER)))

struct timer {
    struct timer *next;
    /* Irq, irqs off, a few us.  TIMER_AGAIN: wait for the new waketime;
     * TIMER_DONE: no more.  It must not add its own timer. */
    bool (*event)(struct timer *timer);
    uint32_t waketime; /* clock */
};

/* For ports whose timer interrupt looks at the list itself. */
extern struct timer *sched_first, sched_sentinel;

enum { TIMER_DONE = false, TIMER_AGAIN = true };

/* Any context.  shutdown("Timer too close") if waketime has passed. */
void sched_add_timer(struct timer *timer);

/* Any context; no matter whether the timer waits. */
void sched_del_timer(struct timer *timer);

/* The same for events that make steps, if other events give way to those: with
 * HAVE_SLOW_EVENTS all others run with irqs on, one after the other. */
#if CONFIG_HAVE_SLOW_EVENTS
void sched_add_step(struct timer *timer);
void sched_del_step(struct timer *timer);
/* Shutdown, irqs off: forget the others. */
void sched_reset_slow(void);

/* Task, or irqs off: no events but steps may come until it is unlocked. */
irq_flag_t sched_lock_events(void);
void sched_unlock_events(irq_flag_t flag);
#else
static inline void sched_add_step(struct timer *timer)
{
    sched_add_timer(timer);
}

static inline void sched_del_step(struct timer *timer)
{
    sched_del_timer(timer);
}

static inline void sched_reset_slow(void)
{
}

static inline irq_flag_t sched_lock_events(void)
{
    return irq_save();
}

static inline void sched_unlock_events(irq_flag_t flag)
{
    irq_restore(flag);
}
#endif

/* In a timer's event: another timer, whether it waits or not, is to wait for
 * `waketime`, which lies ahead. */
void sched_move_timer(struct timer *timer, uint32_t waketime);

/* A task looks at its flag at each pass; whoever sets it keeps the main loop
 * from sleeping until that has happened. */
struct task_wake {
    volatile uint8_t is_set;
};

void sched_wake(struct task_wake *wake);  /* any context */
bool sched_take(struct task_wake *wake);  /* task: was set; clears it */

/* Any context: stop everything with a reason (unique in the firmware). */
#define shutdown(TEXT) sched_shutdown(DECL_STRING_ID(TEXT))
/* The same, but returns if the mcu is already shut down. */
#define try_shutdown(TEXT) sched_try_shutdown(DECL_STRING_ID(TEXT))

void sched_shutdown(uint16_t reason) __attribute__((noreturn));
void sched_try_shutdown(uint16_t reason);
bool sched_is_shutdown(void);
void sched_clear_shutdown(void);

/* Task: tell the host why the mcu does not obey. */
void sched_report_shutdown(void);

#endif
