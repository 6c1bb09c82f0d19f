/* SPDX-License-Identifier: GPL-3.0-or-later
 * The system's watchdog (-w): a process that hangs restarts the machine. */
#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include "core/sched.h"
#include "process.h"

#define FEED_TICKS (CONFIG_CLOCK_FREQ / 2)
#define MAGIC_CLOSE "V" /* an orderly end */

static int watchdog = -1;
static uint64_t next_feed; /* clock */

static void feed(const char *text)
{
    if (write(watchdog, text, 1) < 0)
        process_log("The watchdog cannot be fed: %s", strerror(errno));
}

int watchdog_open(void)
{
    const char *path = process_path("dev/watchdog");

    if (!process_options.has_watchdog)
        return 0;
    watchdog = open(path, O_WRONLY | O_CLOEXEC);
    if (watchdog >= 0)
        return 0;
    process_log("%s cannot be opened: %s. Leave out -w, or load a watchdog "
                "driver and run as root", path, strerror(errno));
    return -1;
}

void watchdog_task(void)
{
    uint64_t now;

    if (watchdog < 0)
        return;
    now = clock_read();
    if (now < next_feed)
        return;
    next_feed = now + FEED_TICKS;
    feed(".");
}
DECL_TASK(watchdog_task);

void watchdog_close(void)
{
    if (watchdog >= 0)
        feed(MAGIC_CLOSE);
}
