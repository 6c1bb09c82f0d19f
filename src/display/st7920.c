/* SPDX-License-Identifier: GPL-3.0-or-later
 * ST7920 graphic displays on their serial interface.
 *
 * A run of bytes begins with a sync byte that tells commands from data; each
 * byte is sent as two, with four bits above four zeros.  A bit is read at the
 * rising edge of the clock, whose levels last 300 ns at least.
 */
#include "board/delay.h"
#include "board/gpio.h"
#include "core/oid.h"
#include "core/sched.h"

enum { SYNC_COMMANDS = 0xf8, SYNC_DATA = 0xfa };
#define PULSE_TICKS DELAY_NS(300)

struct st7920 {
    struct gpio_out cs, sclk, sid;
    uint32_t sync_delay_ticks, cmd_delay_ticks;
    uint32_t byte_clock; /* end of the last byte */
};

static const ROM struct oid_kind st7920_kind = { sizeof(struct st7920) };

void command_config_st7920(const struct args_config_st7920 *args)
{
    struct st7920 set = {
        .sync_delay_ticks = args->sync_delay_ticks,
        .cmd_delay_ticks = args->cmd_delay_ticks,
    }, *s;

    set.cs = gpio_setup_output(args->cs_pin, 0);
    set.sclk = gpio_setup_output(args->sclk_pin, 0);
    set.sid = gpio_setup_output(args->sid_pin, 0);
    s = oid_new(args->oid, &st7920_kind);
    *s = set;
    s->byte_clock = timer_read_clock();
}
DECL_COMMAND(command_config_st7920,
             "config_st7920 oid=%c cs_pin=%u sclk_pin=%u sid_pin=%u"
             " sync_delay_ticks=%u cmd_delay_ticks=%u");

static void send_octet(const struct st7920 *s, uint8_t octet)
{
    for (uint8_t n_bits = 8; n_bits; n_bits--) {
        gpio_write(s->sid, octet & 0x80);
        octet = (uint8_t)(octet << 1);
        delay_ticks(PULSE_TICKS);
        gpio_write(s->sclk, 1);
        delay_ticks(PULSE_TICKS);
        gpio_write(s->sclk, 0);
    }
}

/* The display is busy for a while after each byte. */
static void wait_since_byte(const struct st7920 *s, uint32_t ticks)
{
    uint32_t since = timer_read_clock() - s->byte_clock;

    if (since < ticks)
        delay_ticks(ticks - since);
}

static void send_run(struct st7920 *s, uint8_t sync, uint8_t len,
                     const uint8_t *bytes)
{
    wait_since_byte(s, s->cmd_delay_ticks);
    gpio_write(s->cs, 1);
    send_octet(s, sync);
    delay_ticks(s->sync_delay_ticks);
    for (uint8_t i = 0; i < len; i++) {
        if (i)
            wait_since_byte(s, s->cmd_delay_ticks);
        send_octet(s, bytes[i] & 0xf0);
        send_octet(s, (uint8_t)(bytes[i] << 4));
        s->byte_clock = timer_read_clock();
    }
    gpio_write(s->cs, 0);
}

void command_st7920_send_cmds(const struct args_st7920_send_cmds *args)
{
    send_run(oid_lookup(args->oid, &st7920_kind), SYNC_COMMANDS,
             args->cmds_len, args->cmds);
}
DECL_COMMAND(command_st7920_send_cmds, "st7920_send_cmds oid=%c cmds=%*s");

void command_st7920_send_data(const struct args_st7920_send_data *args)
{
    send_run(oid_lookup(args->oid, &st7920_kind), SYNC_DATA, args->data_len,
             args->data);
}
DECL_COMMAND(command_st7920_send_data, "st7920_send_data oid=%c data=%*s");

/* What was broken off must not count as the start of the next run. */
void st7920_shutdown(void)
{
    struct st7920 *s;
    int16_t oid = -1;

    while ((s = oid_next(&oid, &st7920_kind))) {
        gpio_write(s->cs, 0);
        gpio_write(s->sclk, 0);
    }
}
DECL_SHUTDOWN(st7920_shutdown);
