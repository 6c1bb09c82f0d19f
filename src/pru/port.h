/* SPDX-License-Identifier: GPL-3.0-or-later
 * Handles of the PRU port, and what must be a few instructions.
 */
#ifndef PRU_PORT_H
#define PRU_PORT_H

#include <stdint.h>
#include "lib/pru/am335x.h"
#include "split.h"

typedef uint8_t irq_flag_t;

/* Outputs of a bank as this program drives them: to read them back from the
 * chip takes forty times as long. */
struct pru_bank {
    uint32_t clear; /* address of GPIO_CLEARDATAOUT */
    uint32_t out;
};

struct gpio_out {
    struct pru_bank *bank;
    uint32_t mask;
};
struct gpio_in {
    uint32_t levels; /* address of GPIO_DATAIN */
    uint32_t mask;
};
struct gpio_adc {
    uint8_t input;
};

/* Entry 26 of the table of constants is where the counter begins (4.4.1.1): one
 * instruction. */
static inline uint32_t timer_read_clock(void)
{
    uint32_t clock;

    __asm__ volatile("lbco %0, 26, 12, 4" : "=r"(clock));
    return clock;
}

#if PRU_CORE == 1
/* PRU0 looks how busy both are. */
static inline void load_note(uint32_t ticks)
{
    (void)ticks;
}

/* There is always room for a message, if only for one that is dropped. */
uint8_t *command_begin(uint8_t size) __attribute__((returns_nonnull));

/* PRU0 encodes messages: here numbers are put as they are. */
static inline uint8_t *command_put_int(uint8_t *p, uint32_t value)
{
    __builtin_memcpy(p, &value, sizeof(value));
    return p + sizeof(value);
}
#endif

/* Timers are served by irq_poll() and irq_wait() only, so nothing comes between
 * two instructions of a task. */
static inline void irq_disable(void)
{
}

static inline void irq_enable(void)
{
}

static inline irq_flag_t irq_save(void)
{
    return 0;
}

static inline void irq_restore(irq_flag_t flag)
{
    (void)flag;
}

/* The two registers lie side by side. */
static inline void pru_drive(struct gpio_out out, uint32_t level)
{
    if (level)
        REG32(out.bank->clear + GPIO_SET_AFTER_CLEAR) = out.mask;
    else
        REG32(out.bank->clear) = out.mask;
}

#endif
