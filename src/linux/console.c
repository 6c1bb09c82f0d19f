/* SPDX-License-Identifier: GPL-3.0-or-later
 * Console on a pseudo terminal.
 *
 * Both ends stay open, so that hosts may come and go, and also go on to the
 * next image after a reset, so that a host's open descriptor stays good.
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include "board/console.h"
#include "board/timer.h"
#include "core/sched.h"
#include "process.h"

/* What nobody has read yet stays in the terminal: nothing is ever lost. */
#define RECEIVE_WINDOW 1024
DECL_CONSTANT("RECEIVE_WINDOW", RECEIVE_WINDOW);

enum { RX_SIZE = 240, TX_SIZE = 4096, NAME_SIZE = 64 };
#define SILENCE_S 30
#define NS_PER_S 1000000000
#define HANDED_OVER "KLIPPER_MCU_CONSOLE"

static struct {
    int master, slave;
    const char *link;
    bool has_input;      /* the terminal has more for us */
    uint64_t heard;      /* clock of the last input */
    uint32_t tx_len;
    uint8_t rx_len;
    uint8_t rx[RX_SIZE];
    uint8_t tx[TX_SIZE];
} console;

static volatile sig_atomic_t has_end_signal;
static sigset_t wait_mask; /* signals blocked during a wait only */


/* ---- Opening ---- */

static int open_terminal(void)
{
    struct termios raw;

    memset(&raw, 0, sizeof(raw));
    cfmakeraw(&raw);
    if (openpty(&console.master, &console.slave, NULL, &raw, NULL)) {
        process_log("No pseudo terminal can be had: %s. Is /dev/pts mounted?",
                    strerror(errno));
        return -1;
    }
    fchmod(console.slave, S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP);
    return 0;
}

/* After a reset: the terminal of the image before, without stale input. */
static bool take_over_terminal(void)
{
    const char *text = getenv(HANDED_OVER);

    if (!text || sscanf(text, "%d,%d", &console.master, &console.slave) != 2)
        return false;
    unsetenv(HANDED_OVER);
    if (fcntl(console.master, F_GETFD) < 0 || !isatty(console.slave))
        return false;
    tcflush(console.master, TCIFLUSH);
    return true;
}

void console_hand_over(void)
{
    char text[NAME_SIZE];

    console_flush();
    snprintf(text, sizeof(text), "%d,%d", console.master, console.slave);
    setenv(HANDED_OVER, text, 1);
    fcntl(console.master, F_SETFD, 0);
    fcntl(console.slave, F_SETFD, 0);
}

/* Only a symbolic link is ever replaced. */
static int make_link(const char *link)
{
    struct stat info;
    char name[NAME_SIZE];

    if (!lstat(link, &info) && !S_ISLNK(info.st_mode)) {
        process_log("%s is in the way: it is no symbolic link. Remove it, or "
                    "choose another name with -I", link);
        return -1;
    }
    unlink(link);
    if (ttyname_r(console.slave, name, sizeof(name))
        || symlink(name, link)) {
        process_log("The link %s cannot be made: %s. Choose another name "
                    "with -I", link, strerror(errno));
        return -1;
    }
    process_log("Console %s is %s", link, name);
    return 0;
}

static void note_end_signal(int signal)
{
    (void)signal;
    has_end_signal = 1;
}

/* SIGTERM and SIGINT come only while the process waits. */
static void catch_signals(void)
{
    struct sigaction action = { .sa_handler = note_end_signal };
    sigset_t ends;

    sigemptyset(&ends);
    sigaddset(&ends, SIGTERM);
    sigaddset(&ends, SIGINT);
    sigprocmask(SIG_BLOCK, &ends, &wait_mask);
    sigdelset(&wait_mask, SIGTERM);
    sigdelset(&wait_mask, SIGINT);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
}

int console_open(const char *link)
{
    console.link = link;
    if (!take_over_terminal() && open_terminal())
        return -1;
    fcntl(console.master, F_SETFD, FD_CLOEXEC);
    fcntl(console.slave, F_SETFD, FD_CLOEXEC);
    fcntl(console.master, F_SETFL,
          fcntl(console.master, F_GETFL) | O_NONBLOCK);
    catch_signals();
    return make_link(link);
}

void console_close(void)
{
    console_flush();
    unlink(console.link);
}


/* ---- Input ---- */

static void read_input(void)
{
    size_t room = (size_t)(RX_SIZE - console.rx_len);
    ssize_t n = read(console.master, &console.rx[console.rx_len], room);

    console.has_input = n == (ssize_t)room;
    if (n <= 0)
        return;
    console.rx_len = (uint8_t)(console.rx_len + n);
    console.heard = clock_read();
}

uint8_t console_peek(const uint8_t **data)
{
    if (console.has_input && console.rx_len < RX_SIZE)
        read_input();
    *data = console.rx;
    return console.rx_len;
}

void console_consume(uint8_t len)
{
    console.rx_len = (uint8_t)(console.rx_len - len);
    memmove(console.rx, &console.rx[len], console.rx_len);
}

bool console_wait(int64_t timeout_ns)
{
    struct pollfd fd = { .fd = console.master, .events = POLLIN };
    struct timespec timeout = { .tv_sec = timeout_ns / NS_PER_S,
                                .tv_nsec = timeout_ns % NS_PER_S };
    int n;

    if (console.tx_len)
        fd.events |= POLLOUT;
    if (has_end_signal)
        process_end();
    n = ppoll(&fd, 1, &timeout, &wait_mask);
    if (n <= 0)
        return !n;
    if (fd.revents & POLLIN) {
        console.has_input = true;
        console_note_rx();
    }
    if (fd.revents & POLLOUT)
        console_flush();
    return false;
}


/* ---- Output ---- */

void console_flush(void)
{
    ssize_t n;

    if (!console.tx_len)
        return;
    n = write(console.master, console.tx, console.tx_len);
    if (n <= 0)
        return;
    console.tx_len -= (uint32_t)n;
    memmove(console.tx, &console.tx[n], console.tx_len);
}

/* Nobody has spoken for long: what we say would only wait, and meet the next
 * host as old news. */
static bool is_alone(void)
{
    uint64_t limit = console.heard + (uint64_t)SILENCE_S * CONFIG_CLOCK_FREQ;

    if (clock_read() < limit)
        return false;
    tcflush(console.slave, TCIFLUSH);
    console.tx_len = 0;
    return true;
}

uint8_t *console_reserve(uint8_t len)
{
    if (is_alone())
        return NULL;
    if (console.tx_len + len > TX_SIZE)
        console_flush();
    if (console.tx_len + len > TX_SIZE)
        return NULL;
    return &console.tx[console.tx_len];
}

void console_commit(uint8_t len)
{
    console.tx_len += len;
}
