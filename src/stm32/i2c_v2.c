/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C masters of all STM32 but F1, F2 and F4 (RM0091, 26.4). */
#include "chip.h"
#include "i2c_pins.h"

#if CONFIG_STM32_F2F4F7 || CONFIG_MACH_STM32H7
#define KERNEL_HZ (CONFIG_CLOCK_FREQ / 4u)
#else
#define KERNEL_HZ ((uint32_t)CONFIG_CLOCK_FREQ)
#endif
/* What times are counted in: 63 ns or a little less */
#define PRESCALER ((KERNEL_HZ + 15999999u) / 16000000u)
#define TICK_HZ (KERNEL_HZ / PRESCALER)
_Static_assert(PRESCALER <= 16, "no such prescaler");
#define RATE_MAX 400000u

/* Low for three fifths of a bit, high for the rest */
static uint32_t find_timing(uint32_t rate)
{
    uint32_t ticks, low, high;

    if (!rate)
        rate = 1;
    if (rate > RATE_MAX)
        rate = RATE_MAX;
    ticks = (TICK_HZ + rate - 1) / rate;
    low = ticks * 3 / 5;
    high = ticks - low;
    if (low > 256)
        low = 256;
    if (high > 256)
        high = 256;
    return I2C_TIMINGR(PRESCALER, 5, 2, low, high);
}

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    i2c_regs_t *regs = i2c_open(bus);

#if CONFIG_MACH_STM32F0
    RCC->CFGR3 |= RCC_CFGR3_I2C1_SYSCLK;
#endif
    regs->CR1 = 0;
    regs->TIMINGR = find_timing(rate);
    regs->CR1 = I2C_V2_CR1_PE;
    return (struct i2c_config) { .regs = regs, .addr = addr };
}

/* Wait for what comes next; a refusal ends with a stop by itself. */
static enum i2c_result wait_next(i2c_regs_t *regs, uint32_t bits,
                                 enum i2c_result on_nack)
{
    if (!i2c_wait_for(&regs->ISR, bits | I2C_ISR_NACKF))
        return I2C_TIMEOUT;
    if (!(regs->ISR & I2C_ISR_NACKF))
        return I2C_OK;
    if (!i2c_wait_for(&regs->ISR, I2C_ISR_STOPF))
        return I2C_TIMEOUT;
    return on_nack;
}

/* Ends with a stop, or, before a read, with the clock held low. */
static enum i2c_result write_bytes(struct i2c_config config, uint8_t len,
                                   const uint8_t *data, bool is_last)
{
    i2c_regs_t *regs = config.regs;
    enum i2c_result result = I2C_OK, on_nack = I2C_START_NACK;

    regs->CR2 = I2C_CR2_ADDRESS(config.addr) | I2C_CR2_COUNT(len)
        | (is_last ? I2C_CR2_AUTOEND : 0) | I2C_CR2_START;
    for (; len; len--) {
        result = wait_next(regs, I2C_ISR_TXIS, on_nack);
        if (result != I2C_OK)
            return result;
        regs->TXDR = *data++;
        on_nack = I2C_NACK;
    }
    return wait_next(regs, is_last ? I2C_ISR_STOPF : I2C_ISR_TC, on_nack);
}

static enum i2c_result read_bytes(struct i2c_config config, uint8_t len,
                                  uint8_t *data)
{
    i2c_regs_t *regs = config.regs;
    enum i2c_result result;

    regs->CR2 = I2C_CR2_ADDRESS(config.addr) | I2C_CR2_COUNT(len)
        | I2C_CR2_READ | I2C_CR2_AUTOEND | I2C_CR2_START;
    for (; len; len--) {
        result = wait_next(regs, I2C_ISR_RXNE, I2C_START_READ_NACK);
        if (result != I2C_OK)
            return result;
        *data++ = (uint8_t)regs->RXDR;
    }
    return wait_next(regs, I2C_ISR_STOPF, I2C_NACK);
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    i2c_regs_t *regs = config.regs;
    enum i2c_result result = I2C_OK;

    regs->ICR = I2C_ISR_STOPF | I2C_ISR_NACKF;
    if (write_len || !read_len)
        result = write_bytes(config, write_len, write, !read_len);
    if (result == I2C_OK && read_len)
        result = read_bytes(config, read_len, read);
    if (result == I2C_TIMEOUT) {
        /* off for three cycles: lets go of the bus */
        regs->CR1 = 0;
        while (regs->CR1 & I2C_V2_CR1_PE)
            ;
        regs->CR1 = I2C_V2_CR1_PE;
    }
    /* what a refused write has left */
    regs->ISR = I2C_ISR_TXE;
    return result;
}
