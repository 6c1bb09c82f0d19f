/* SPDX-License-Identifier: GPL-3.0-or-later
 * The process that the firmware runs in: its options, time, console, start and
 * end.
 */
#ifndef LINUX_PROCESS_H
#define LINUX_PROCESS_H

#include <stdbool.h>
#include <stdint.h>

struct process_options {
    const char *link;    /* symbolic link to the console's terminal */
    const char *root;    /* folder that holds dev and sys; "" is the real one */
    const char *fake;    /* folder of the fake board; NULL: real devices */
    bool is_realtime;
    bool has_watchdog;
    uint32_t max_late_ms; /* 0: the defaults of clock.c */
    uint32_t adc_bits;
};

extern struct process_options process_options;

/* A line on stderr: what is wrong, and what would be right. */
void process_log(const char *fmt, ...) __attribute__((format(printf, 1, 2)));

/* "<root>/<fmt...>" in a static buffer. */
const char *process_path(const char *fmt, ...)
    __attribute__((format(printf, 1, 2)));

/* Task: does what reset_mcu() has asked for. */
void process_poll(void);

/* Task, never returns: shut down, then (called again) the end. */
void process_end(void) __attribute__((noreturn));

/* options.c: fill in process_options; ends the process on a wrong option. */
void options_read(int argc, char **argv);

/* realtime.c: 0, or -1 after saying what to do about it. */
int realtime_enter(void);

/* watchdog.c: 0, or -1 after a message; and the orderly end. */
int watchdog_open(void);
void watchdog_close(void);

/* clock.c: clock 0 is now.  Clocks of 64 bits never wrap. */
void clock_start(void);
uint64_t clock_read(void);
uint64_t clock_start_ns(void);

/* console.c: the terminal; 0 or -1 after a message. */
int console_open(const char *link);
void console_close(void);       /* takes the link away */
void console_hand_over(void);   /* to the image that follows */
void console_flush(void);       /* send what fits, without blocking */
/* Sleep until input, a signal to end, or the time; true if it was the time. */
bool console_wait(int64_t timeout_ns);

#endif
