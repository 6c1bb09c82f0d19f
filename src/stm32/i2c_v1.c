/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C masters of F1, F2 and F4 (RM0008, 26.3; "Closing the communication").
 *
 * The last bytes of a read are known to the peripheral one byte ahead: it is
 * told to stop while it holds the clock low, so interrupts do no harm.
 */
#include "board/irq.h"
#include "chip.h"
#include "i2c_pins.h"

#if CONFIG_MACH_STM32F1 || CONFIG_MACH_STM32F401
#define BUS_HZ (CONFIG_CLOCK_FREQ / 2)
#else
#define BUS_HZ (CONFIG_CLOCK_FREQ / 4)
#endif
#define BUS_MHZ (BUS_HZ / 1000000u)
#define STANDARD_RATE 100000

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    i2c_regs_t *regs = i2c_open(bus);
    bool is_fast = rate > STANDARD_RATE;
    uint32_t divider;

    if (!rate)
        rate = 1;
    if (rate > 400000)
        rate = 400000;
    /* low and high: halves, or two parts and one of three */
    divider = BUS_HZ / (rate * (is_fast ? 3 : 2));
    if (divider * rate * (is_fast ? 3 : 2) < BUS_HZ)
        divider++;
    if (divider > I2C_V1_CCR_MAX)
        divider = I2C_V1_CCR_MAX;
    regs->CR1 = I2C_V1_CR1_SWRST;
    regs->CR1 = 0;
    regs->CR2 = BUS_MHZ;
    regs->CCR = divider | (is_fast ? I2C_V1_CCR_FAST : 0);
    /* 1000 or 300 ns */
    regs->TRISE = is_fast ? BUS_MHZ * 3 / 10 + 1 : BUS_MHZ + 1;
    regs->CR1 = I2C_V1_CR1_PE;
    return (struct i2c_config) { .regs = regs, .addr = addr };
}

/* (Repeated) start and address; the address flag is still up afterwards. */
static enum i2c_result start(i2c_regs_t *regs, uint8_t address,
                             enum i2c_result on_nack)
{
    regs->CR1 |= I2C_V1_CR1_START;
    if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_SB))
        return I2C_TIMEOUT;
    regs->DR = address;
    if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_ADDR | I2C_V1_SR1_AF))
        return I2C_TIMEOUT;
    return regs->SR1 & I2C_V1_SR1_AF ? on_nack : I2C_OK;
}

static void clear_address_flag(i2c_regs_t *regs)
{
    (void)regs->SR1;
    (void)regs->SR2;
}

static enum i2c_result write_bytes(i2c_regs_t *regs, uint8_t addr,
                                   uint8_t len, const uint8_t *data)
{
    enum i2c_result result = start(regs, (uint8_t)(addr << 1),
                                   I2C_START_NACK);

    if (result != I2C_OK)
        return result;
    clear_address_flag(regs);
    while (len--) {
        regs->DR = *data++;
        if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_BTF | I2C_V1_SR1_AF))
            return I2C_TIMEOUT;
        if (regs->SR1 & I2C_V1_SR1_AF)
            return I2C_NACK;
    }
    return I2C_OK;
}

/* One byte: refused and stopped as soon as the address is through. */
static bool read_one(i2c_regs_t *regs, uint8_t *data)
{
    irq_flag_t flag = irq_save();

    regs->CR1 &= ~I2C_V1_CR1_ACK;
    clear_address_flag(regs);
    regs->CR1 |= I2C_V1_CR1_STOP;
    irq_restore(flag);
    if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_RXNE))
        return false;
    *data = (uint8_t)regs->DR;
    return true;
}

/* Two bytes: the refusal is said to be of the second. */
static bool read_two(i2c_regs_t *regs, uint8_t *data)
{
    irq_flag_t flag = irq_save();

    regs->CR1 |= I2C_V1_CR1_POS;
    clear_address_flag(regs);
    regs->CR1 &= ~I2C_V1_CR1_ACK;
    irq_restore(flag);
    if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_BTF))
        return false;
    flag = irq_save();
    regs->CR1 |= I2C_V1_CR1_STOP;
    data[0] = (uint8_t)regs->DR;
    irq_restore(flag);
    data[1] = (uint8_t)regs->DR;
    return true;
}

/* With three to come, two are held and the clock stands still. */
static bool read_many(i2c_regs_t *regs, uint8_t len, uint8_t *data)
{
    irq_flag_t flag;

    clear_address_flag(regs);
    for (; len > 3; len--) {
        if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_RXNE))
            return false;
        *data++ = (uint8_t)regs->DR;
    }
    if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_BTF))
        return false;
    regs->CR1 &= ~I2C_V1_CR1_ACK;
    flag = irq_save();
    data[0] = (uint8_t)regs->DR;
    regs->CR1 |= I2C_V1_CR1_STOP;
    irq_restore(flag);
    data[1] = (uint8_t)regs->DR;
    if (!i2c_wait_for(&regs->SR1, I2C_V1_SR1_RXNE))
        return false;
    data[2] = (uint8_t)regs->DR;
    return true;
}

static enum i2c_result read_bytes(i2c_regs_t *regs, uint8_t addr, uint8_t len,
                                  uint8_t *data)
{
    enum i2c_result result;
    bool is_ok;

    regs->CR1 |= I2C_V1_CR1_ACK;
    result = start(regs, (uint8_t)(addr << 1 | 1), I2C_START_READ_NACK);
    if (result != I2C_OK)
        return result;
    if (len == 1)
        is_ok = read_one(regs, data);
    else
        is_ok = len == 2 ? read_two(regs, data) : read_many(regs, len, data);
    return is_ok ? I2C_OK : I2C_TIMEOUT;
}

/* The bus is free again when the stop is through. */
static bool wait_stop(i2c_regs_t *regs)
{
    uint32_t tries;

    for (tries = 0; tries < CONFIG_CLOCK_FREQ / 20000; tries++)
        if (!(regs->CR1 & I2C_V1_CR1_STOP))
            return true;
    return false;
}

/* A bus that does not move is let go of. */
static void start_anew(i2c_regs_t *regs)
{
    uint32_t divider = regs->CCR, rise = regs->TRISE;

    regs->CR1 = I2C_V1_CR1_SWRST;
    regs->CR1 = 0;
    regs->CR2 = BUS_MHZ;
    regs->CCR = divider;
    regs->TRISE = rise;
    regs->CR1 = I2C_V1_CR1_PE;
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    i2c_regs_t *regs = config.regs;
    enum i2c_result result = I2C_OK;
    bool has_stop = false;

    if (write_len || !read_len)
        result = write_bytes(regs, config.addr, write_len, write);
    if (result == I2C_OK && read_len) {
        result = read_bytes(regs, config.addr, read_len, read);
        has_stop = result == I2C_OK;
    }
    if (!has_stop)
        regs->CR1 |= I2C_V1_CR1_STOP;
    if (result == I2C_TIMEOUT || !wait_stop(regs)) {
        start_anew(regs);
        return I2C_TIMEOUT;
    }
    regs->SR1 = 0;
    regs->CR1 &= ~I2C_V1_CR1_POS;
    return result;
}
