/* SPDX-License-Identifier: GPL-3.0-or-later
 * UART in software, half duplex, for TMC stepper drivers.
 *
 * The host hands over and gets bits as they are on the wire, lowest first,
 * start and stop bits included.  One event a level change while writing.
 * While reading, each frame is looked for four times a bit and then sampled in
 * the middle of its bits, so that clocks need to agree for ten bits only.
 */
#include <stdbool.h>
#include <string.h>

#include "board/gpio.h"
#include "board/irq.h"
#include "board/timer.h"
#include "core/oid.h"
#include "core/sched.h"

enum {
    DATA_MAX = 10,
    FRAME_BITS = 10,
    RECOVERY_BITS = 12,        /* of idle line after a failed datagram */
    REPLY_POLLS_MAX = 4 * 160, /* drivers answer after 120 bits at most */
};

enum tmcuart_state { IS_IDLE, IS_BUSY, IS_DONE };

struct tmcuart {
    struct timer timer;
    struct gpio_out tx;
    struct gpio_in rx;
    uint32_t bit_time;
    uint32_t end_clock;     /* when the line was last used */
    int8_t pull;
    bool is_one_pin;
    uint8_t state;
    uint8_t n_bits, pos;    /* of what is being written or read */
    uint8_t frame_left;     /* bits of the frame being read */
    uint8_t n_read;         /* bytes to read */
    uint16_t polls_left;
    uint8_t data[DATA_MAX];
};

static const ROM struct oid_kind tmcuart_kind = { sizeof(struct tmcuart) };
static struct task_wake tmcuart_wake;

static bool read_bit(const struct tmcuart *t, uint8_t pos)
{
    return t->data[pos >> 3] & (1 << (pos & 7));
}

/* The line is high while nobody talks. */
static void drive_idle(struct tmcuart *t)
{
    gpio_drive(t->tx, 1);
}

static bool finish(struct tmcuart *t, uint8_t n_read)
{
    t->n_read = n_read;
    t->end_clock = t->timer.waketime;
    t->state = IS_DONE;
    drive_idle(t);
    sched_wake(&tmcuart_wake);
    return TIMER_DONE;
}


/* ---- Reading ---- */

static bool seek_event(struct timer *timer);

static bool sample_event(struct timer *timer)
{
    struct tmcuart *t = CONTAINER_OF(timer, struct tmcuart, timer);
    uint8_t bit = (uint8_t)(1u << (t->pos & 7));

    if (gpio_read(t->rx))
        t->data[t->pos >> 3] |= bit;
    if (++t->pos == t->n_bits)
        return finish(t, t->n_read);
    timer->waketime += t->bit_time;
    if (!--t->frame_left) {
        timer->waketime -= t->bit_time - t->bit_time / 4;
        timer->event = seek_event;
        t->polls_left = REPLY_POLLS_MAX;
    }
    return TIMER_AGAIN;
}

/* Wait for a start bit. */
static bool seek_event(struct timer *timer)
{
    struct tmcuart *t = CONTAINER_OF(timer, struct tmcuart, timer);
    uint32_t quarter = t->bit_time / 4;

    if (gpio_read(t->rx)) {
        if (!--t->polls_left)
            return finish(t, 0);
        timer->waketime += quarter;
        return TIMER_AGAIN;
    }
    t->frame_left = FRAME_BITS;
    timer->event = sample_event;
    timer->waketime += quarter + quarter / 2; /* fell half a poll ago */
    return TIMER_AGAIN;
}

static bool start_reading(struct tmcuart *t)
{
    if (!t->n_read)
        return finish(t, 0);
    memset(t->data, 0, sizeof(t->data));
    t->n_bits = (uint8_t)(t->n_read * 8);
    t->pos = 0;
    t->polls_left = REPLY_POLLS_MAX;
    if (t->is_one_pin)
        gpio_float(t->rx, t->pull);
    t->timer.event = seek_event;
    t->timer.waketime += t->bit_time / 4;
    return TIMER_AGAIN;
}


/* ---- Writing ---- */

static bool write_event(struct timer *timer)
{
    struct tmcuart *t = CONTAINER_OF(timer, struct tmcuart, timer);
    bool level;

    if (t->pos == t->n_bits)
        return start_reading(t);
    level = read_bit(t, t->pos);
    gpio_write(t->tx, level);
    do
        timer->waketime += t->bit_time;
    while (++t->pos < t->n_bits && read_bit(t, t->pos) == level);
    return TIMER_AGAIN;
}

/* As soon as the line has been idle for long enough. */
static void start_writing(struct tmcuart *t)
{
    uint32_t now = timer_read_clock(), pause = RECOVERY_BITS * t->bit_time;
    uint32_t idle = now - t->end_clock;

    t->timer.event = write_event;
    t->timer.waketime = now + t->bit_time;
    if (idle < pause)
        t->timer.waketime += pause - idle;
    t->pos = 0;
    t->state = IS_BUSY;
    sched_add_timer(&t->timer);
}

void command_config_tmcuart(const struct args_config_tmcuart *args)
{
    struct gpio_in rx = gpio_setup_input(args->rx_pin, (int8_t)args->pull_up);
    struct gpio_out tx = gpio_setup_output(args->tx_pin, 1);
    struct tmcuart *t = oid_new(args->oid, &tmcuart_kind);

    t->rx = rx;
    t->tx = tx;
    t->pull = (int8_t)args->pull_up;
    t->is_one_pin = args->rx_pin == args->tx_pin;
    t->bit_time = args->bit_time;
    t->end_clock = timer_read_clock();
}
DECL_COMMAND(command_config_tmcuart,
             "config_tmcuart oid=%c rx_pin=%u pull_up=%c tx_pin=%u"
             " bit_time=%u");

/* Dropped while the last one is under way: the host sends it again. */
void command_tmcuart_send(const struct args_tmcuart_send *args)
{
    struct tmcuart *t = oid_lookup(args->oid, &tmcuart_kind);

    if (args->write_len > DATA_MAX || args->read > DATA_MAX)
        shutdown("tmcuart data too large");
    if (t->state != IS_IDLE)
        return;
    memcpy(t->data, args->write, args->write_len);
    t->n_bits = (uint8_t)(args->write_len * 8);
    t->n_read = args->read;
    start_writing(t);
}
DECL_COMMAND(command_tmcuart_send, "tmcuart_send oid=%c write=%*s read=%c");

void tmcuart_task(void)
{
    struct tmcuart *t;
    int16_t oid = -1;

    if (!sched_take(&tmcuart_wake))
        return;
    while ((t = oid_next(&oid, &tmcuart_kind))) {
        if (t->state != IS_DONE)
            continue;
        sendf("tmcuart_response oid=%c read=%*s", (uint8_t)oid, t->n_read,
              t->data);
        t->state = IS_IDLE;
    }
}
DECL_TASK(tmcuart_task);

void tmcuart_shutdown(void)
{
    struct tmcuart *t;
    int16_t oid = -1;

    while ((t = oid_next(&oid, &tmcuart_kind))) {
        t->state = IS_IDLE;
        t->end_clock = timer_read_clock();
        drive_idle(t);
    }
}
DECL_SHUTDOWN(tmcuart_shutdown);
