/* SPDX-License-Identifier: GPL-3.0-or-later
 * Neopixel leds: WS2812, SK6812 and what speaks like them.
 *
 * Each bit is a pulse whose length tells 0 from 1; only the pulse itself needs
 * irqs off.  The leds take a longer pause between two bits for the end of
 * the transmission, so one that was interrupted for too long has failed.
 * Limits of the data sheets: 0 is high for 200 to 500 ns, 1 for 550 ns or more,
 * a bit takes 1250 ns on average.
 */
#include <stdbool.h>
#include <string.h>

#include "board/delay.h"
#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/arena.h"
#include "core/oid.h"
#include "core/sched.h"

#define ZERO_NS 250
#define ONE_NS 750
#define BIT_NS 1250
#define REST_TICKS(NS) \
    (BIT_NS - (NS) > PORT_DELAY_LOOP_NS \
     ? DELAY_NS(BIT_NS - (NS) - PORT_DELAY_LOOP_NS) : 0)

struct neopixel {
    struct gpio_out pin;
    delay_stamp_t bit_max_ticks; /* between the rising edges of two bits */
    uint32_t reset_min_ticks;
    uint32_t end_clock;     /* of the last transmission */
    uint16_t size;
    uint8_t *data;
};

static const ROM struct oid_kind neopixel_kind = { sizeof(struct neopixel) };

void command_config_neopixel(const struct args_config_neopixel *args)
{
    struct gpio_out pin = gpio_setup_output(args->pin, 0);
    struct neopixel *n;

    if (args->data_size > INT16_MAX)
        shutdown("Invalid neopixel data_size");
    n = oid_new(args->oid, &neopixel_kind);
    n->pin = pin;
    n->bit_max_ticks = (delay_stamp_t)~0;
    if (args->bit_max_ticks < n->bit_max_ticks)
        n->bit_max_ticks = (delay_stamp_t)args->bit_max_ticks;
    n->reset_min_ticks = args->reset_min_ticks;
    n->size = args->data_size;
    n->data = arena_alloc(args->data_size);
    n->end_clock = timer_read_clock();
}
DECL_COMMAND(command_config_neopixel,
             "config_neopixel oid=%c pin=%u data_size=%hu bit_max_ticks=%u"
             " reset_min_ticks=%u");

void command_neopixel_update(const struct args_neopixel_update *args)
{
    struct neopixel *n = oid_lookup(args->oid, &neopixel_kind);

    if (args->data_len > n->size || args->pos > n->size - args->data_len)
        shutdown("Invalid neopixel update command");
    memcpy(n->data + args->pos, args->data, args->data_len);
}
DECL_COMMAND(command_neopixel_update,
             "neopixel_update oid=%c pos=%hu data=%*s");

/* The empty asm keeps the compiler from merging the two pulses, which would
 * put a test between their edges. */
static inline void pulse_one(struct gpio_out pin)
{
    __asm__ volatile("/* 1 */");
    gpio_toggle_irq(pin);
    delay_ticks(DELAY_NS(ONE_NS));
    gpio_toggle_irq(pin);
    irq_enable();
    delay_ticks(REST_TICKS(ONE_NS));
}

static inline void pulse_zero(struct gpio_out pin)
{
    __asm__ volatile("/* 0 */");
    gpio_toggle_irq(pin);
    delay_ticks(DELAY_NS(ZERO_NS));
    gpio_toggle_irq(pin);
    irq_enable();
    delay_ticks(REST_TICKS(ZERO_NS));
}

/* False if a pause got too long.  All in one loop: what passes between the
 * last bit of a byte and the next is a pause, too. */
static bool send_bytes(struct gpio_out pin, const uint8_t *data,
                       const uint8_t *end, delay_stamp_t limit)
{
    delay_stamp_t last, now;

    irq_disable();
    last = delay_stamp();
    irq_enable();
    for (; data != end; data++) {
        uint8_t byte = *data;
        for (uint8_t n_bits = 8; n_bits; n_bits--) {
            irq_disable();
            now = delay_stamp();
            if ((delay_stamp_t)(now - last) > limit) {
                irq_enable();
                return false;
            }
            last = now;
            if (byte & 0x80)
                pulse_one(pin);
            else
                pulse_zero(pin);
            byte = (uint8_t)(byte << 1);
        }
    }
    return true;
}

/* Whether all leds have their new colours. */
static bool send_all(struct neopixel *n)
{
    uint32_t since = timer_read_clock() - n->end_clock;
    bool is_sent;

    if (since < n->reset_min_ticks)
        delay_ticks(n->reset_min_ticks - since);
    is_sent = send_bytes(n->pin, n->data, n->data + n->size,
                         n->bit_max_ticks);
    n->end_clock = timer_read_clock();
    return is_sent;
}

void command_neopixel_send(const struct args_neopixel_send *args)
{
    struct neopixel *n = oid_lookup(args->oid, &neopixel_kind);

    sendf("neopixel_result oid=%c success=%c", args->oid, send_all(n));
}
DECL_COMMAND(command_neopixel_send, "neopixel_send oid=%c");
