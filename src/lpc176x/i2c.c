/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C masters (UM10360, chapter 19): each step of a transfer raises SI and says
 * in STAT what has happened. */
#include <stdbool.h>

#include "board/i2c.h"
#include "board/timer.h"
#include "chip.h"
#include "core/sched.h"

DECL_ENUMERATION("i2c_bus", "i2c1", 0);
DECL_CONSTANT_STR("BUS_PINS_i2c1", "P0.1,P0.0");
DECL_ENUMERATION("i2c_bus", "i2c1a", 1);
DECL_CONSTANT_STR("BUS_PINS_i2c1a", "P0.20,P0.19");
DECL_ENUMERATION("i2c_bus", "i2c0", 2);
DECL_CONSTANT_STR("BUS_PINS_i2c0", "P0.28,P0.27");
DECL_ENUMERATION("i2c_bus", "i2c2", 3);
DECL_CONSTANT_STR("BUS_PINS_i2c2", "P0.11,P0.10");

/* A byte with its acknowledgement may take 50 us a bit. */
#define BYTE_TIMEOUT_US 450
#define RATE_MAX 400000u

static const struct {
    struct i2c_regs *regs;
    uint8_t power, scl, sda, function;
} buses[] = {
    { (struct i2c_regs *)I2C1_BASE, I2C1_POWER, GPIO(0, 1), GPIO(0, 0), 3 },
    { (struct i2c_regs *)I2C1_BASE, I2C1_POWER, GPIO(0, 20), GPIO(0, 19), 3 },
    { (struct i2c_regs *)I2C0_BASE, I2C0_POWER, GPIO(0, 28), GPIO(0, 27), 1 },
    { (struct i2c_regs *)I2C2_BASE, I2C2_POWER, GPIO(0, 11), GPIO(0, 10), 2 },
};

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    uint32_t ticks;
    struct i2c_regs *regs;

    if (bus >= sizeof(buses) / sizeof(buses[0]))
        shutdown("Unsupported i2c bus");
    if (!rate)
        rate = 1;
    if (rate > RATE_MAX)
        rate = RATE_MAX;
    ticks = (CONFIG_CLOCK_FREQ + rate - 1) / rate;
    regs = buses[bus].regs;
    chip_enable(buses[bus].power);
    gpio_alternate(buses[bus].scl, buses[bus].function | GPIO_OPEN_DRAIN, 1);
    gpio_alternate(buses[bus].sda, buses[bus].function | GPIO_OPEN_DRAIN, 1);
    regs->CONCLR = I2C_AA | I2C_SI | I2C_STA | I2C_EN;
    /* low for three fifths of a bit */
    regs->SCLL = ticks * 3 / 5 > 0xffff ? 0xffff : ticks * 3 / 5;
    regs->SCLH = ticks * 2 / 5 > 0xffff ? 0xffff : ticks * 2 / 5;
    regs->CONSET = I2C_EN;
    return (struct i2c_config) { .regs = regs, .addr = addr };
}

/* Let the next step begin and wait for its end: what has happened, or 0 when it
 * takes too long. */
static uint8_t step(struct i2c_regs *regs, uint32_t clear)
{
    uint32_t start = timer_read_clock();
    uint32_t limit = timer_from_us(BYTE_TIMEOUT_US);

    regs->CONCLR = clear | I2C_SI;
    while (!(regs->CONSET & I2C_SI))
        if (timer_read_clock() - start > limit)
            return 0;
    return (uint8_t)regs->STAT;
}

static enum i2c_result start(struct i2c_regs *regs, uint8_t address,
                             uint8_t acknowledged, enum i2c_result on_nack)
{
    uint8_t status;

    regs->CONSET = I2C_STA;
    status = step(regs, I2C_AA);
    if (status != I2C_STAT_START && status != I2C_STAT_RESTART)
        return I2C_TIMEOUT;
    regs->DAT = address;
    status = step(regs, I2C_STA);
    if (!status)
        return I2C_TIMEOUT;
    return status == acknowledged ? I2C_OK : on_nack;
}

static enum i2c_result write_bytes(struct i2c_config config, uint8_t len,
                                   const uint8_t *data)
{
    struct i2c_regs *regs = config.regs;
    enum i2c_result result = start(regs, (uint8_t)(config.addr << 1),
                                   I2C_STAT_WRITE_ACK, I2C_START_NACK);

    while (result == I2C_OK && len--) {
        uint8_t status;

        regs->DAT = *data++;
        status = step(regs, 0);
        if (status != I2C_STAT_DATA_ACK)
            result = status ? I2C_NACK : I2C_TIMEOUT;
    }
    return result;
}

/* The last byte is not acknowledged. */
static enum i2c_result read_bytes(struct i2c_config config, uint8_t len,
                                  uint8_t *data)
{
    struct i2c_regs *regs = config.regs;
    enum i2c_result result = start(regs, (uint8_t)(config.addr << 1 | 1),
                                   I2C_STAT_READ_ACK, I2C_START_READ_NACK);

    while (result == I2C_OK && len--) {
        uint8_t status;

        if (len)
            regs->CONSET = I2C_AA;
        status = step(regs, len ? 0 : I2C_AA);
        if (status != I2C_STAT_GOT_ACK && status != I2C_STAT_GOT_NACK)
            result = I2C_TIMEOUT;
        *data++ = (uint8_t)regs->DAT;
    }
    return result;
}

/* The bus is free again when the stop is through. */
static bool stop(struct i2c_regs *regs)
{
    uint32_t start = timer_read_clock();
    uint32_t limit = timer_from_us(BYTE_TIMEOUT_US);

    regs->CONSET = I2C_STO;
    regs->CONCLR = I2C_SI | I2C_STA | I2C_AA;
    while (regs->CONSET & I2C_STO)
        if (timer_read_clock() - start > limit)
            return false;
    return true;
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    enum i2c_result result = I2C_OK;

    if (write_len || !read_len)
        result = write_bytes(config, write_len, write);
    if (result == I2C_OK && read_len)
        result = read_bytes(config, read_len, read);
    if (!stop(config.regs) || result == I2C_TIMEOUT) {
        /* off and on: lets go of the bus */
        config.regs->CONCLR = I2C_EN;
        config.regs->CONSET = I2C_EN;
        return I2C_TIMEOUT;
    }
    return result;
}
