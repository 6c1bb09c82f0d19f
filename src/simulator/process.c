/* SPDX-License-Identifier: GPL-3.0-or-later
 * The simulated mcu as a process: console on a pty, time of the real clock, and
 * a world without anything in it.
 *
 * usage: klipper.elf [-I link]   (default link /tmp/klipper_simulator)
 */
#define _GNU_SOURCE
#include <errno.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "vmcu_abi.h"

#define NS_PER_S UINT64_C(1000000000)
enum { RX_CHUNK = 64 };

/* Lives on main()'s stack: variables belong to the mcu's power cycle. */
struct process {
    int pty;
    bool wants_reset;
    uint8_t rx[RX_CHUNK];
    uint32_t rx_len;
};

static void process_tx(void *ctx, uint64_t clock, const uint8_t *buf,
                       uint32_t len)
{
    struct process *p = ctx;

    (void)clock;
    if (write(p->pty, buf, len) < 0 && errno != EAGAIN && errno != EIO)
        perror("write to pty");
}

static void ignore_pin(void *ctx, uint64_t clock, uint32_t pin, uint8_t level)
{
    (void)ctx, (void)clock, (void)pin, (void)level;
}

static uint8_t read_pull(void *ctx, uint64_t clock, uint32_t pin, int8_t pull)
{
    (void)ctx, (void)clock, (void)pin;
    return pull > 0;
}

static uint16_t read_middle(void *ctx, uint64_t clock, uint32_t pin)
{
    (void)ctx, (void)clock, (void)pin;
    return 0x8000;
}

static void ignore_pwm(void *ctx, uint64_t clock, uint32_t pin,
                       uint32_t cycle_ticks, uint32_t value, uint32_t max)
{
    (void)ctx, (void)clock, (void)pin, (void)cycle_ticks, (void)value;
    (void)max;
}

static void answer_ones(void *ctx, uint64_t clock, uint32_t bus, uint8_t *buf,
                        uint32_t len)
{
    (void)ctx, (void)clock, (void)bus;
    memset(buf, 0xff, len);
}

static int32_t answer_nobody(void *ctx, uint64_t clock, uint32_t bus,
                             uint8_t addr, const uint8_t *wr, uint32_t wr_len,
                             uint8_t *rd, uint32_t rd_len)
{
    (void)ctx, (void)clock, (void)bus, (void)addr, (void)wr, (void)wr_len;
    (void)rd, (void)rd_len;
    return -1;
}

static void note_reset(void *ctx, uint64_t clock)
{
    (void)clock;
    ((struct process *)ctx)->wants_reset = true;
}

/* The process may be held up by the system: nothing to report. */
static void ignore_late(void *ctx, uint64_t clock, uint64_t late)
{
    (void)ctx, (void)clock, (void)late;
}

static uint64_t read_ns(void)
{
    struct timespec ts;

    clock_gettime(CLOCK_MONOTONIC, &ts);
    return (uint64_t)ts.tv_sec * NS_PER_S + (uint64_t)ts.tv_nsec;
}

static uint64_t ns_to_clock(uint64_t ns, uint32_t freq)
{
    return ns / NS_PER_S * freq + ns % NS_PER_S * freq / NS_PER_S;
}

/* Open a pty and make `link` point at it.  Both ends stay open, so that hosts
 * may come and go. */
static int open_console(const char *link)
{
    struct termios raw;
    int master, slave;
    char name[64];

    memset(&raw, 0, sizeof(raw));
    cfmakeraw(&raw);
    if (openpty(&master, &slave, name, &raw, NULL)) {
        perror("openpty");
        return -1;
    }
    unlink(link);
    if (symlink(name, link)) {
        perror(link);
        return -1;
    }
    printf("Console %s -> %s\n", link, name);
    fflush(stdout);
    return master;
}

static void wait_input(struct process *p, int timeout_ms)
{
    struct pollfd fd = { .fd = p->pty, .events = POLLIN };
    ssize_t n;

    if (p->rx_len || poll(&fd, 1, timeout_ms) <= 0)
        return;
    n = read(p->pty, p->rx, sizeof(p->rx));
    if (n > 0)
        p->rx_len = (uint32_t)n;
}

static void run_forever(struct process *p, const struct vmcu_host *host,
                        const struct vmcu_ops *ops)
{
    uint64_t start = read_ns(), clock, next;

    ops->power_on(host, 0);
    for (;;) {
        clock = ns_to_clock(read_ns() - start, ops->clock_freq);
        if (p->rx_len && ops->rx(clock, p->rx, p->rx_len))
            p->rx_len = 0;
        next = ops->run(clock);
        if (p->wants_reset) {
            p->wants_reset = false;
            ops->power_off();
            ops->power_on(host, clock);
            continue;
        }
        next = (next - clock) / (ops->clock_freq / 1000);
        wait_input(p, next < 1000 ? (int)next : 1000);
    }
}

int main(int argc, char **argv)
{
    const char *link = "/tmp/klipper_simulator";
    struct process p = { .pty = -1 };
    struct vmcu_host host = {
        .ctx = &p, .tx = process_tx, .pin_out = ignore_pin,
        .pin_in = read_pull, .adc_in = read_middle, .pwm_out = ignore_pwm,
        .spi = answer_ones, .i2c = answer_nobody, .reset = note_reset,
        .late = ignore_late,
    };
    int opt;

    while ((opt = getopt(argc, argv, "I:")) != -1) {
        if (opt != 'I') {
            fprintf(stderr, "usage: %s [-I link]\n", argv[0]);
            return 2;
        }
        link = optarg;
    }
    signal(SIGPIPE, SIG_IGN);
    p.pty = open_console(link);
    if (p.pty < 0)
        return 1;
    run_forever(&p, &host, vmcu_get_ops());
    return 0;
}
