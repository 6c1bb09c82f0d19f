/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C masters on SERCOM units: data at pad 0, clock at pad 1 (data sheets,
 * SERCOM I2C). */
#include "board/i2c.h"
#include "board/timer.h"
#include "chip.h"
#include "core/sched.h"
#include "sercom.h"

/* 50 us a bit */
#define BYTE_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 450)
/* What the edges take, in periods of the clock: 200 ns, and the unit's own
 * 10 */
#define EDGE_PERIODS (PERIPHERAL_HZ / 5000000 + 10)

static void sync(struct sercom_regs *regs)
{
    while (regs->SYNCBUSY)
        ;
}

/* Forget what is under way; the bus counts as idle. */
static void restart(struct sercom_regs *regs)
{
    regs->CTRLA &= ~SERCOM_CTRLA_ENABLE;
    sync(regs);
    regs->CTRLA |= SERCOM_CTRLA_ENABLE;
    sync(regs);
    regs->STATUS = SERCOM_STATUS_IDLE;
    sync(regs);
}

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    struct i2c_config config = { sercom_open(bus), addr };
    uint32_t periods;

    if (!config.regs)
        shutdown("Unsupported i2c bus");
    if (sercom_connect_role(bus, SERCOM_TX, 1) != 0
        || sercom_connect_role(bus, SERCOM_CLK, 1) != 1)
        shutdown("Invalid SERCOM configuration");
    rate = rate < 10000 ? 10000 : rate > 400000 ? 400000 : rate;
    periods = PERIPHERAL_HZ / rate;
    periods = (periods - EDGE_PERIODS + 1) / 2;
    config.regs->CTRLA = SERCOM_CTRLA_MODE(SERCOM_MODE_I2C)
        | SERCOM_CTRLA_SDAHOLD_450NS | SERCOM_CTRLA_INACTOUT_205US;
    config.regs->BAUD = periods > 255 ? 255 : periods;
    restart(config.regs);
    return config;
}

/* Wait until one of `flags` comes; false: it does not. */
static bool wait_for(struct sercom_regs *regs, uint8_t flags)
{
    uint32_t start = timer_read_clock();

    while (!(regs->INTFLAG & flags))
        if (timer_read_clock() - start > BYTE_TICKS)
            return false;
    return !(regs->STATUS & (SERCOM_STATUS_BUSERR | SERCOM_STATUS_ARBLOST));
}

static void stop(struct sercom_regs *regs, uint32_t nack)
{
    regs->CTRLB = nack | SERCOM_CTRLB_CMD(SERCOM_CMD_STOP);
    sync(regs);
}

static enum i2c_result send_address(struct sercom_regs *regs, uint32_t addr,
                                    enum i2c_result refused)
{
    regs->ADDR = addr;
    sync(regs);
    if (!wait_for(regs, SERCOM_INT_MB | SERCOM_INT_SB))
        return I2C_TIMEOUT;
    if (regs->INTFLAG & SERCOM_INT_MB && regs->STATUS & SERCOM_STATUS_RXNACK)
        return refused;
    return I2C_OK;
}

static enum i2c_result write_bytes(struct sercom_regs *regs, uint8_t len,
                                   const uint8_t *data)
{
    while (len--) {
        regs->DATA8 = *data++;
        sync(regs);
        if (!wait_for(regs, SERCOM_INT_MB))
            return I2C_TIMEOUT;
        if (regs->STATUS & SERCOM_STATUS_RXNACK)
            return I2C_NACK;
    }
    return I2C_OK;
}

/* The answer to a byte goes out with the command for the next, before it is
 * fetched: the last is not acknowledged. */
static enum i2c_result read_bytes(struct sercom_regs *regs, uint8_t len,
                                  uint8_t *data)
{
    while (len--) {
        if (!wait_for(regs, SERCOM_INT_SB))
            return I2C_TIMEOUT;
        if (!len)
            stop(regs, SERCOM_CTRLB_NACK);
        *data++ = regs->DATA8;
        if (!len)
            break;
        regs->CTRLB = SERCOM_CTRLB_CMD(SERCOM_CMD_READ);
        sync(regs);
    }
    return I2C_OK;
}

static enum i2c_result run(struct i2c_config config, uint8_t write_len,
                           const uint8_t *write, uint8_t read_len,
                           uint8_t *read)
{
    struct sercom_regs *regs = config.regs;
    uint32_t addr = 2u * config.addr;
    enum i2c_result result = I2C_OK;

    if (write_len || !read_len) {
        result = send_address(regs, addr, I2C_START_NACK);
        if (!result)
            result = write_bytes(regs, write_len, write);
    }
    if (!result && read_len) {
        result = send_address(regs, addr | 1, write_len ? I2C_START_READ_NACK
                              : I2C_START_NACK);
        if (!result)
            return read_bytes(regs, read_len, read);
    }
    if (result != I2C_TIMEOUT)
        stop(regs, 0);
    return result;
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    enum i2c_result result = run(config, write_len, write, read_len, read);

    if (result == I2C_TIMEOUT)
        restart(config.regs);
    return result;
}
