/* SPDX-License-Identifier: GPL-3.0-or-later
 * A toy mcu for tests of the virtual world: it keeps a log of what reaches it.
 *
 * Its messages, one byte of command and integers (VLQ):
 *   1 len bytes...       append the bytes to the log, with the clock
 *   2 index              answer 2 index clock_low clock_high len bytes...
 *   3 pin level          drive a pin
 *   4 pin count ticks    toggle a pin every so many ticks
 *   5 pin pull           answer 5 level
 *   6 pin                answer 6 analog value
 *   7                    ask for a reset
 *   8 pin value max      hardware pwm
 *   9                    answer 9 log_count clock_low clock_high boots
 *  10 late               claim a late timer
 *  11 bus a b            exchange two bytes over SPI, answer 11 a b
 *  12 bus addr reg       write a byte, read two over I2C: 12 error a b
 */
#include <stdlib.h>
#include <string.h>

#include "msgblock.h"
#include "vmcu_abi.h"

enum { N_PINS = 16, RX_SIZE = 192, LOG_SIZE = 20000 };

struct entry {
    uint64_t clock;
    uint8_t len, data[MSGBLOCK_MAX];
};

static const struct vmcu_host *host;
static uint64_t now, next_toggle;
static uint32_t toggle_pin, toggle_count, toggle_ticks;
static uint8_t levels[N_PINS], rx_buf[RX_SIZE], expected;
static uint32_t rx_len, n_entries, n_boots;
static struct entry entries[LOG_SIZE];

static void
send_block(const uint8_t *payload, size_t len)
{
    uint8_t block[MSGBLOCK_MAX];
    size_t size = msgblock_build(block, expected, payload, len);

    host->tx(host->ctx, now, block, (uint32_t)size);
}

static void
answer(const uint32_t *values, int count, const uint8_t *data, size_t len)
{
    uint8_t payload[MSGBLOCK_MAX], *p = payload;

    for (int i = 0; i < count; i++)
        p = msgblock_put_int(p, values[i]);
    if (len)
        memcpy(p, data, len);
    send_block(payload, (size_t)(p - payload) + len);
}

static void
dump(uint32_t index)
{
    const struct entry *e = &entries[index % LOG_SIZE];
    uint32_t values[] = { 2, index, (uint32_t)e->clock,
                          (uint32_t)(e->clock >> 32), e->len };

    answer(values, 5, e->data, e->len);
}

static void
write_pin(uint32_t pin, uint32_t level)
{
    levels[pin % N_PINS] = (uint8_t)level;
    host->pin_out(host->ctx, now, pin, (uint8_t)level);
}

static void
exchange_spi(uint32_t bus, uint32_t first, uint32_t second)
{
    uint8_t buf[] = { (uint8_t)first, (uint8_t)second };

    host->spi(host->ctx, now, bus, buf, 2);
    answer((uint32_t[]) { 11, buf[0], buf[1] }, 3, NULL, 0);
}

static void
exchange_i2c(uint32_t bus, uint32_t addr, uint32_t reg)
{
    uint8_t wr[] = { (uint8_t)reg }, rd[2];
    int32_t error = host->i2c(host->ctx, now, bus, (uint8_t)addr, wr, 1, rd, 2);

    answer((uint32_t[]) { 12, !!error, rd[0], rd[1] }, 4, NULL, 0);
}

static void
run_command(const uint32_t *a)
{
    switch (a[0]) {
    case 2:
        dump(a[1]);
        break;
    case 3:
        write_pin(a[1], a[2]);
        break;
    case 4:
        toggle_pin = a[1];
        toggle_count = a[2];
        toggle_ticks = a[3];
        next_toggle = now + a[3];
        break;
    case 5:
        answer((uint32_t[]) { 5, host->pin_in(host->ctx, now, a[1],
                                              (int8_t)a[2]) }, 2, NULL, 0);
        break;
    case 6:
        answer((uint32_t[]) { 6, host->adc_in(host->ctx, now, a[1]) }, 2,
               NULL, 0);
        break;
    case 7:
        host->reset(host->ctx, now);
        break;
    case 8:
        host->pwm_out(host->ctx, now, a[1], 1000, a[2], a[3]);
        break;
    case 9:
        answer((uint32_t[]) { 9, n_entries, (uint32_t)now,
                              (uint32_t)(now >> 32), n_boots }, 5, NULL, 0);
        break;
    case 10:
        host->late(host->ctx, now, a[1]);
        break;
    case 11:
        exchange_spi(a[1], a[2], a[3]);
        break;
    case 12:
        exchange_i2c(a[1], a[2], a[3]);
        break;
    }
}

static const uint8_t *
append_log(const uint8_t *p)
{
    struct entry *e = &entries[n_entries++ % LOG_SIZE];

    e->clock = now;
    e->len = *p++;
    memcpy(e->data, p, e->len);
    return p + e->len;
}

static void
run_payload(const uint8_t *p, const uint8_t *end)
{
    static const uint8_t n_args[] = { 0, 0, 1, 2, 3, 2, 1, 0, 3, 0, 1,
                                      3, 3 };

    while (p < end) {
        uint32_t a[4] = { *p++ };
        if (a[0] == 1) {
            p = append_log(p);
            continue;
        }
        for (int i = 0; a[0] < sizeof(n_args) && i < n_args[a[0]]; i++)
            if (msgblock_get_int(&p, end, &a[1 + i]))
                return;
        run_command(a);
    }
}

static void
run_block(const uint8_t *block, int len)
{
    if ((block[1] & MSGBLOCK_SEQ_MASK) == expected) {
        expected = (expected + 1) & MSGBLOCK_SEQ_MASK;
        run_payload(block + MSGBLOCK_HEADER, block + len - MSGBLOCK_TRAILER);
    }
    send_block(NULL, 0);
}

static void
parse(void)
{
    uint32_t pos = 0;
    int found, was_garbage = 0;

    while ((found = msgblock_check(rx_buf + pos, rx_len - pos)) != 0) {
        if (found > 0)
            run_block(rx_buf + pos, found);
        else if (found < -1 && !was_garbage)
            send_block(NULL, 0);
        was_garbage = found < 0;
        pos += (uint32_t)abs(found);
    }
    rx_len -= pos;
    memmove(rx_buf, rx_buf + pos, rx_len);
}

static int32_t
power_on(const struct vmcu_host *h, uint64_t clock)
{
    host = h;
    now = clock;
    next_toggle = UINT64_MAX;
    expected = 5;
    n_boots++;
    return 0;
}

static uint64_t
run(uint64_t until)
{
    while (next_toggle <= until) {
        now = next_toggle;
        write_pin(toggle_pin, !levels[toggle_pin % N_PINS]);
        next_toggle = --toggle_count ? now + toggle_ticks : UINT64_MAX;
    }
    now = until;
    return next_toggle;
}

static int32_t
rx(uint64_t clock, const uint8_t *buf, uint32_t len)
{
    run(clock);
    if (len > RX_SIZE - rx_len)
        return 0;
    memcpy(rx_buf + rx_len, buf, len);
    rx_len += len;
    parse();
    return 1;
}

static int32_t
find_pin(const char *name)
{
    return name[0] == 'P' ? (int32_t)strtol(name + 1, NULL, 10) : -1;
}

static void
power_off(void)
{
}

const struct vmcu_ops *
vmcu_get_ops(void)
{
    static const struct vmcu_ops ops = {
        .abi_version = VMCU_ABI_VERSION, .clock_freq = 1000000,
        .n_pins = N_PINS, .name = "echo", .power_on = power_on, .rx = rx,
        .run = run, .find_pin = find_pin, .power_off = power_off,
    };

    return &ops;
}
