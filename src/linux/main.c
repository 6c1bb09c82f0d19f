/* SPDX-License-Identifier: GPL-3.0-or-later
 * Start, reset and end of the linux process. */
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "board/irq.h"
#include "board/reset.h"
#include "core/sched.h"
#include "devices.h"
#include "process.h"

static char **arguments;
static bool wants_reset;

void process_log(const char *fmt, ...)
{
    va_list args;

    va_start(args, fmt);
    fputs("klipper_mcu: ", stderr);
    vfprintf(stderr, fmt, args);
    fputc('\n', stderr);
    va_end(args);
}

const char *process_path(const char *fmt, ...)
{
    static char path[512];
    int len = snprintf(path, sizeof(path), "%s/", process_options.root);
    va_list args;

    va_start(args, fmt);
    if (len >= 0 && (size_t)len < sizeof(path))
        vsnprintf(path + len, sizeof(path) - (size_t)len, fmt, args);
    va_end(args);
    return path;
}

/* Outputs must not stay as they are when the kernel takes the pins back: the
 * first call shuts the mcu down, the next one finds it so. */
void process_end(void)
{
    try_shutdown("Mcu process was told to end");
    watchdog_close();
    console_close();
    exit(0);
}

void reset_mcu(void)
{
    wants_reset = true;
    try_shutdown("Mcu reset");
}

/* A fresh image of the same program: nothing of this one remains but the
 * console.  The system closes all other descriptors. */
void process_poll(void)
{
    if (!wants_reset)
        return;
    console_hand_over();
    execv("/proc/self/exe", arguments);
    process_log("The reset failed: %s", strerror(errno));
    console_close();
    exit(1);
}

int main(int argc, char **argv)
{
    arguments = argv;
    options_read(argc, argv);
    clock_start();
    if (devices_open() || watchdog_open() || console_open(process_options.link)
        || realtime_enter())
        return 1;
    sched_main();
}
