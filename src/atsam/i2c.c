/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C masters (11057, 33.8).
 *
 * What is written before a read, up to three bytes, is the peripheral's
 * "internal address": it does the repeated start.  More than that ends
 * with a stop first.
 */
#include <stdbool.h>

#include "board/i2c.h"
#include "board/timer.h"
#include "chip.h"
#include "core/sched.h"

/* 50 us a bit, for two addresses, three bytes inside and one of data */
#define TIMEOUT_US (6 * 450)
#define RATE_MAX 400000u
#define INTERNAL_MAX 3

static const struct {
    uint32_t base;
    uint8_t id, scl, sda;
    char peripheral;
} buses[] = {
#if CONFIG_MACH_SAM3X
    { TWI0_BASE, TWI0_ID, GPIO('A', 18), GPIO('A', 17), 'A' },
    { TWI1_BASE, TWI1_ID, GPIO('B', 13), GPIO('B', 12), 'A' },
#else
    { TWI0_BASE, TWI0_ID, GPIO('A', 4), GPIO('A', 3), 'A' },
    { TWI1_BASE, TWI1_ID, GPIO('B', 5), GPIO('B', 4), 'A' },
#endif
#if CONFIG_MACH_SAME70
    { TWI2_BASE, TWI2_ID, GPIO('D', 28), GPIO('D', 27), 'C' },
#endif
};
#define N_BUSES (sizeof(buses) / sizeof(buses[0]))

#if CONFIG_MACH_SAM3X
DECL_ENUMERATION_RANGE("i2c_bus", "twi0", 0, 2);
DECL_CONSTANT_STR("BUS_PINS_twi0", "PA18,PA17");
DECL_CONSTANT_STR("BUS_PINS_twi1", "PB13,PB12");
#elif CONFIG_MACH_SAME70
DECL_ENUMERATION_RANGE("i2c_bus", "twihs0", 0, 3);
DECL_CONSTANT_STR("BUS_PINS_twihs0", "PA4,PA3");
DECL_CONSTANT_STR("BUS_PINS_twihs1", "PB5,PB4");
DECL_CONSTANT_STR("BUS_PINS_twihs2", "PD28,PD27");
#else
DECL_ENUMERATION_RANGE("i2c_bus", "twi0", 0, 2);
DECL_CONSTANT_STR("BUS_PINS_twi0", "PA4,PA3");
DECL_CONSTANT_STR("BUS_PINS_twi1", "PB5,PB4");
#endif

/* Low and high for `ticks / 2` of MCK: (n << shift) + 4, of a SAM E70 + 3. */
static uint32_t find_timing(uint32_t rate)
{
    uint32_t half = (MCK_FREQ + 2 * rate - 1) / (2 * rate) - 3, shift = 0;

    while ((half >> shift) > 254 && shift < 7)
        shift++;
    half = (half >> shift) + 1;
    if (half > 255)
        half = 255;
    return TWI_CWGR(half, half, shift);
}

static void start_anew(struct twi_regs *regs)
{
    uint32_t timing = regs->CWGR;

    regs->CR = TWI_CR_SWRST;
    (void)regs->RHR;
    regs->CWGR = timing;
    regs->CR = TWI_CR_SVDIS;
    regs->CR = TWI_CR_MSEN;
}

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    struct twi_regs *regs;

    if (bus >= N_BUSES)
        shutdown("Unsupported i2c bus");
    regs = (struct twi_regs *)buses[bus].base;
    if (rate > RATE_MAX)
        rate = RATE_MAX;
    if (rate < 1000)
        rate = 1000;
    chip_enable(buses[bus].id);
    gpio_open_drain(buses[bus].scl, buses[bus].peripheral);
    gpio_open_drain(buses[bus].sda, buses[bus].peripheral);
    regs->CWGR = find_timing(rate);
    start_anew(regs);
    return (struct i2c_config) { .regs = regs, .addr = addr };
}

/* Wait for a bit of the status; reading that clears a refusal. */
static enum i2c_result wait_for(struct twi_regs *regs, uint32_t bit,
                                enum i2c_result on_nack)
{
    uint32_t start = timer_read_clock(), status;
    uint32_t limit = timer_from_us(TIMEOUT_US);

    for (;;) {
        status = regs->SR;
        if (status & TWI_SR_NACK)
            return on_nack;
        if (status & TWI_SR_OVRE)
            return I2C_TIMEOUT;
        if (status & bit)
            return I2C_OK;
        if (timer_read_clock() - start > limit)
            return I2C_TIMEOUT;
    }
}

/* The first byte sends the address as well.  After a refusal the peripheral
 * has stopped by itself. */
static enum i2c_result write_bytes(struct i2c_config config, uint8_t len,
                                   const uint8_t *data)
{
    struct twi_regs *regs = config.regs;
    enum i2c_result result = I2C_OK, on_nack = I2C_START_NACK;

    regs->MMR = TWI_MMR_DADR(config.addr);
    if (!len) {
        regs->CR = TWI_CR_QUICK;
        return wait_for(regs, TWI_SR_TXCOMP, on_nack);
    }
    while (len--) {
        regs->THR = *data++;
        if (!len)
            regs->CR = TWI_CR_STOP;
        result = wait_for(regs, TWI_SR_TXRDY, on_nack);
        if (result != I2C_OK)
            return result;
        on_nack = I2C_NACK;
    }
    return wait_for(regs, TWI_SR_TXCOMP, on_nack);
}

/* The stop is asked for while the last byte comes in. */
static enum i2c_result read_bytes(struct i2c_config config, uint8_t len,
                                  uint8_t *data)
{
    struct twi_regs *regs = config.regs;
    enum i2c_result result;

    regs->CR = len == 1 ? TWI_CR_START | TWI_CR_STOP : TWI_CR_START;
    while (len--) {
        result = wait_for(regs, TWI_SR_RXRDY, I2C_START_READ_NACK);
        if (result != I2C_OK)
            return result;
        if (len == 1)
            regs->CR = TWI_CR_STOP;
        *data++ = (uint8_t)regs->RHR;
    }
    return wait_for(regs, TWI_SR_TXCOMP, I2C_START_READ_NACK);
}

static enum i2c_result write_and_read(struct i2c_config config,
                                      uint8_t write_len, const uint8_t *write,
                                      uint8_t read_len, uint8_t *read)
{
    uint32_t internal = 0;
    uint8_t i;

    for (i = 0; i < write_len; i++)
        internal = internal << 8 | write[i];
    config.regs->MMR = TWI_MMR_DADR(config.addr) | TWI_MMR_MREAD
        | TWI_MMR_IADRSZ(write_len);
    config.regs->IADR = internal;
    return read_bytes(config, read_len, read);
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    enum i2c_result result = I2C_OK;
    uint8_t ahead = write_len;

    if (!read_len || write_len > INTERNAL_MAX) {
        result = write_bytes(config, write_len, write);
        ahead = 0;
    }
    if (result == I2C_OK && read_len)
        result = write_and_read(config, ahead, write, read_len, read);
    if (result == I2C_TIMEOUT)
        start_anew(config.regs);
    return result;
}
