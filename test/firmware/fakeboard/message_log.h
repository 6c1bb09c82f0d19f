/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the firmware said during a job, and whether it can be true. */
#ifndef FAKEBOARD_MESSAGE_LOG_H
#define FAKEBOARD_MESSAGE_LOG_H

#include <stdbool.h>
#include <stdint.h>

enum { LOG_MAX_REPLIES = 8, LOG_MESSAGE = 59 };

struct message_log {
    uint32_t n_replies; /* to what was sent once `is_over` was set */
    uint8_t replies[LOG_MAX_REPLIES][LOG_MESSAGE];
    uint32_t n_finals;  /* reports of triggers that have fired, before that */
    bool is_over;
};

/* Log from now on into `log`.  The next answers are to be to
 * stepper_get_position and trsync_trigger. */
void message_log_start(struct message_log *log);

/* A stepper's position is going to be asked for: the answer must be where its
 * edges have brought it, now or when the answer comes. */
void message_log_expect_position(uint8_t oid, uint8_t step_pin,
                                 uint8_t dir_pin, bool both_edges);

#endif
