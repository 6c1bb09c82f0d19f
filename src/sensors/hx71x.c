/* SPDX-License-Identifier: GPL-3.0-or-later
 * HX711 and HX717 load cell converters, clocked by hand.
 *
 * DOUT falls when a reading is ready; 24 pulses of SCLK shift it out, one to
 * four more choose channel and gain of the next.  SCLK high for 60 us powers
 * the chip down, so irqs are off while it is high; when it falls the chip
 * starts anew with the first gain, and its first reading is not used.
 */
#include "board/delay.h"
#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "sensors/bulk.h"
#include "sensors/trigger_analog.h"

enum { READING_BITS = 24, GAIN_MAX = 4, POWER_DOWN_US = 100 };
#define PULSE_TICKS DELAY_NS(300)

/* What is sent instead of a reading; beyond all readings. */
#define SAMPLE_DESYNC UINT32_C(0x80000000)
#define SAMPLE_TOO_LONG UINT32_C(0x40000000)
enum { ERROR_DESYNC, ERROR_TOO_LONG };

struct hx71x {
    struct bulk bulk;
    struct trigger_analog *trigger; /* may be NULL */
    struct gpio_in dout;
    struct gpio_out sclk;
    uint8_t gain_pulses;
    bool is_first;                  /* since the chip was started */
};

static const ROM struct oid_kind hx71x_kind = { sizeof(struct hx71x) };

static struct hx71x *from_bulk(struct bulk *bulk)
{
    return CONTAINER_OF(bulk, struct hx71x, bulk);
}

static bool is_ready(struct bulk *bulk)
{
    return !gpio_read(from_bulk(bulk)->dout);
}

static uint8_t pulse(const struct hx71x *h)
{
    uint8_t bit;

    irq_disable();
    gpio_write(h->sclk, 1);
    delay_ticks(PULSE_TICKS);
    bit = gpio_read(h->dout);
    gpio_write(h->sclk, 0);
    irq_enable();
    delay_ticks(PULSE_TICKS);
    return bit;
}

/* Sign extended; the chip shows that it has taken all pulses by raising
 * DOUT. */
static int32_t shift_in(const struct hx71x *h)
{
    uint32_t value = 0;

    for (uint8_t i = 0; i < READING_BITS; i++)
        value = value << 1 | pulse(h);
    for (uint8_t i = 0; i < h->gain_pulses; i++)
        pulse(h);
    return (int32_t)(value << 8) >> 8;
}

static void restart_chip(struct hx71x *h)
{
    gpio_write(h->sclk, 1);
    delay_ticks(timer_from_us(POWER_DOWN_US));
    gpio_write(h->sclk, 0);
    h->is_first = true;
}

static void give_up(struct hx71x *h, uint32_t sample, uint8_t error)
{
    bulk_add_number(&h->bulk, sample);
    trigger_analog_note_error(h->trigger, error);
    restart_chip(h);
}

static bool read_sample(struct bulk *bulk)
{
    struct hx71x *h = from_bulk(bulk);
    uint32_t start = timer_read_clock();
    int32_t value = shift_in(h);
    bool is_slow = timer_read_clock() - start > bulk->rest_ticks;

    if (is_ready(bulk)) {
        give_up(h, SAMPLE_DESYNC, ERROR_DESYNC);
    } else if (is_slow) {
        give_up(h, SAMPLE_TOO_LONG, ERROR_TOO_LONG);
    } else if (h->is_first) {
        h->is_first = false;
    } else {
        bulk_add_number(bulk, (uint32_t)value);
        trigger_analog_update(h->trigger, value);
    }
    return false;
}

static uint16_t count_waiting(struct bulk *bulk)
{
    return is_ready(bulk);
}

static const ROM struct bulk_kind hx71x_bulk = {
    .sample_size = 4, .is_ready = is_ready, .read = read_sample,
    .count_waiting = count_waiting,
};

void command_config_hx71x(const struct args_config_hx71x *args)
{
    struct gpio_in dout;
    struct gpio_out sclk;
    struct hx71x *h;

    if (args->gain_channel < 1 || args->gain_channel > GAIN_MAX)
        shutdown("HX71x gain/channel out of range 1-4");
    dout = gpio_setup_input(args->dout_pin, 1);
    sclk = gpio_setup_output(args->sclk_pin, 1);
    h = oid_new(args->oid, &hx71x_kind);
    h->dout = dout;
    h->sclk = sclk;
    h->gain_pulses = args->gain_channel;
    bulk_setup(&h->bulk, &hx71x_bulk, args->oid);
}
DECL_COMMAND(command_config_hx71x,
             "config_hx71x oid=%c gain_channel=%c dout_pin=%u sclk_pin=%u");

#if CONFIG_WANT_TRIGGER_ANALOG
void command_hx71x_attach_trigger_analog(
    const struct args_hx71x_attach_trigger_analog *args)
{
    struct hx71x *h = oid_lookup(args->oid, &hx71x_kind);

    h->trigger = trigger_analog_lookup(args->trigger_analog_oid);
}
DECL_COMMAND(command_hx71x_attach_trigger_analog,
             "hx71x_attach_trigger_analog oid=%c trigger_analog_oid=%c");
#endif

void command_query_hx71x(const struct args_query_hx71x *args)
{
    struct hx71x *h = oid_lookup(args->oid, &hx71x_kind);

    gpio_write(h->sclk, !args->rest_ticks);
    h->is_first = true;
    bulk_query(&h->bulk, args->rest_ticks);
}
DECL_COMMAND(command_query_hx71x, "query_hx71x oid=%c rest_ticks=%u");

void command_query_hx71x_status(const struct args_query_hx71x_status *args)
{
    struct hx71x *h = oid_lookup(args->oid, &hx71x_kind);

    bulk_send_status(&h->bulk);
}
DECL_COMMAND(command_query_hx71x_status, "query_hx71x_status oid=%c");

void hx71x_shutdown(void)
{
    struct hx71x *h;
    int16_t oid = -1;

    while ((h = oid_next(&oid, &hx71x_kind)))
        gpio_write(h->sclk, 1);
}
DECL_SHUTDOWN(hx71x_shutdown);
