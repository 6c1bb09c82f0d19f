/* SPDX-License-Identifier: GPL-3.0-or-later
 * Triggers: one event (an endstop, the host, a timeout) stops many things.
 */
#ifndef MOTION_TRSYNC_H
#define MOTION_TRSYNC_H

#include <stdint.h>
#include "core/decl.h"

struct trsync;

/* Someone who wants to know; `on_trigger` runs with irqs off, once. */
struct trsync_signal {
    struct trsync_signal *next;
    void (*on_trigger)(struct trsync_signal *signal, uint8_t reason);
};

/* Task: the object of config_trsync. */
struct trsync *trsync_lookup(uint8_t oid);

/* Task: call signal->on_trigger when `ts` triggers (at once if it has). */
void trsync_add_signal(struct trsync *ts, struct trsync_signal *signal,
                       void (*on_trigger)(struct trsync_signal *, uint8_t));

/* Any context: trigger, if it is armed. */
void trsync_trigger(struct trsync *ts, uint8_t reason);

#endif
