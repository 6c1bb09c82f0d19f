/* SPDX-License-Identifier: GPL-3.0-or-later
 * HD44780 character displays on four data pins.
 *
 * Each byte takes the display some time, so sending waits, with irqs on.  A
 * nibble is read at the falling edge of E, which is high for 450 ns at least.
 */
#include "board/delay.h"
#include "board/gpio.h"
#include "core/oid.h"
#include "core/sched.h"

enum { DATA_PINS = 4 };
#define ENABLE_TICKS DELAY_NS(500)

struct hd44780 {
    struct gpio_out rs, enable, data[DATA_PINS];
    uint32_t delay_ticks; /* from one byte to the next */
    uint32_t byte_clock;  /* of the last byte */
};

static const ROM struct oid_kind hd44780_kind = { sizeof(struct hd44780) };

void command_config_hd44780(const struct args_config_hd44780 *args)
{
    const uint32_t pins[DATA_PINS] = {
        args->d4_pin, args->d5_pin, args->d6_pin, args->d7_pin
    };
    struct hd44780 set = { .delay_ticks = args->delay_ticks }, *h;

    set.rs = gpio_setup_output(args->rs_pin, 0);
    set.enable = gpio_setup_output(args->e_pin, 0);
    for (uint8_t i = 0; i < DATA_PINS; i++)
        set.data[i] = gpio_setup_output(pins[i], 0);
    h = oid_new(args->oid, &hd44780_kind);
    *h = set;
    h->byte_clock = timer_read_clock();
}
DECL_COMMAND(command_config_hd44780,
             "config_hd44780 oid=%c rs_pin=%u e_pin=%u d4_pin=%u d5_pin=%u"
             " d6_pin=%u d7_pin=%u delay_ticks=%u");

static void send_nibble(const struct hd44780 *h, uint8_t bits)
{
    for (uint8_t i = 0; i < DATA_PINS; i++, bits = (uint8_t)(bits >> 1))
        gpio_write(h->data[i], bits & 1);
    gpio_write(h->enable, 1);
    delay_ticks(ENABLE_TICKS);
    gpio_write(h->enable, 0);
    delay_ticks(ENABLE_TICKS);
}

static void send_bytes(struct hd44780 *h, uint8_t is_text, uint8_t len,
                       const uint8_t *bytes)
{
    gpio_write(h->rs, is_text);
    for (; len; len--, bytes++) {
        uint32_t since = timer_read_clock() - h->byte_clock;
        if (since < h->delay_ticks)
            delay_ticks(h->delay_ticks - since);
        send_nibble(h, *bytes >> 4);
        send_nibble(h, *bytes & 15);
        h->byte_clock = timer_read_clock();
    }
}

void command_hd44780_send_cmds(const struct args_hd44780_send_cmds *args)
{
    send_bytes(oid_lookup(args->oid, &hd44780_kind), 0, args->cmds_len,
               args->cmds);
}
DECL_COMMAND(command_hd44780_send_cmds, "hd44780_send_cmds oid=%c cmds=%*s");

void command_hd44780_send_data(const struct args_hd44780_send_data *args)
{
    send_bytes(oid_lookup(args->oid, &hd44780_kind), 1, args->data_len,
               args->data);
}
DECL_COMMAND(command_hd44780_send_data, "hd44780_send_data oid=%c data=%*s");

/* Broken off in the middle of a byte, the next command is the second half: the
 * host begins with one that the display takes either way. */
void hd44780_shutdown(void)
{
    struct hd44780 *h;
    int16_t oid = -1;

    while ((h = oid_next(&oid, &hd44780_kind)))
        gpio_write(h->enable, 0);
}
DECL_SHUTDOWN(hd44780_shutdown);
