/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C masters (data sheet, 4.3). */
#include <stddef.h>

#include "board/i2c.h"
#include "board/timer.h"
#include "chip.h"
#include "core/sched.h"

/* By the names that configs use: data, clock */
DECL_ENUMERATION("i2c_bus", "i2c0a", 0);
DECL_CONSTANT_STR("BUS_PINS_i2c0a", "gpio0,gpio1");
DECL_ENUMERATION("i2c_bus", "i2c0b", 1);
DECL_CONSTANT_STR("BUS_PINS_i2c0b", "gpio4,gpio5");
DECL_ENUMERATION("i2c_bus", "i2c0c", 2);
DECL_CONSTANT_STR("BUS_PINS_i2c0c", "gpio8,gpio9");
DECL_ENUMERATION("i2c_bus", "i2c0d", 3);
DECL_CONSTANT_STR("BUS_PINS_i2c0d", "gpio12,gpio13");
DECL_ENUMERATION("i2c_bus", "i2c0e", 4);
DECL_CONSTANT_STR("BUS_PINS_i2c0e", "gpio16,gpio17");
DECL_ENUMERATION("i2c_bus", "i2c0f", 5);
DECL_CONSTANT_STR("BUS_PINS_i2c0f", "gpio20,gpio21");
DECL_ENUMERATION("i2c_bus", "i2c0g", 6);
DECL_CONSTANT_STR("BUS_PINS_i2c0g", "gpio24,gpio25");
DECL_ENUMERATION("i2c_bus", "i2c0h", 7);
DECL_CONSTANT_STR("BUS_PINS_i2c0h", "gpio28,gpio29");
DECL_ENUMERATION("i2c_bus", "i2c1a", 8);
DECL_CONSTANT_STR("BUS_PINS_i2c1a", "gpio2,gpio3");
DECL_ENUMERATION("i2c_bus", "i2c1b", 9);
DECL_CONSTANT_STR("BUS_PINS_i2c1b", "gpio6,gpio7");
DECL_ENUMERATION("i2c_bus", "i2c1c", 10);
DECL_CONSTANT_STR("BUS_PINS_i2c1c", "gpio10,gpio11");
DECL_ENUMERATION("i2c_bus", "i2c1d", 11);
DECL_CONSTANT_STR("BUS_PINS_i2c1d", "gpio14,gpio15");
DECL_ENUMERATION("i2c_bus", "i2c1e", 12);
DECL_CONSTANT_STR("BUS_PINS_i2c1e", "gpio18,gpio19");
DECL_ENUMERATION("i2c_bus", "i2c1f", 13);
DECL_CONSTANT_STR("BUS_PINS_i2c1f", "gpio22,gpio23");
DECL_ENUMERATION("i2c_bus", "i2c1g", 14);
DECL_CONSTANT_STR("BUS_PINS_i2c1g", "gpio26,gpio27");

/* Buses are pairs of pins, those of I2C0 first */
#define N_I2C0 8
#define N_BUSES 15

/* 50 us a bit, nine bits: none takes longer */
#define BYTE_TICKS (CONFIG_CLOCK_FREQ / 1000000 * 450)

static void configure(struct i2c_regs *regs, uint32_t period)
{
    uint32_t low = period * 3 / 5;

    regs->ENABLE = 0;
    regs->CON = I2C_CON_MASTER | I2C_CON_FAST | I2C_CON_RESTART
        | I2C_CON_NO_SLAVE;
    regs->FS_SCL_LCNT = low;
    regs->FS_SCL_HCNT = period - low;
    regs->FS_SPKLEN = low < 16 ? 1 : low / 16;
    /* data changes 300 ns after the clock fell */
    regs->SDA_HOLD = SYS_MHZ * 3 / 10 + 1;
    regs->INTR_MASK = 0;
}

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    struct i2c_config config = { .addr = addr };
    bool is_i2c1 = bus >= N_I2C0;
    uint32_t pin = is_i2c1 ? 4 * (bus - N_I2C0) + 2 : 4 * bus;

    if (bus >= N_BUSES)
        shutdown("Unsupported i2c bus");
    config.regs = (struct i2c_regs *)(is_i2c1 ? I2C1_BASE : I2C0_BASE);
    if (rate > 400000)
        rate = 400000;
    config.period = SYS_FREQ / (rate < 10000 ? 10000 : rate);
    chip_enable(is_i2c1 ? RESET_I2C1 : RESET_I2C0);
    configure(config.regs, config.period);
    gpio_function(pin, IO_I2C, 1);
    gpio_function(pin + 1, IO_I2C, 1);
    return config;
}

/* The controller tells what was not acknowledged, not where in the transfer. */
static enum i2c_result find_cause(struct i2c_regs *regs, bool is_reading)
{
    uint32_t source = regs->TX_ABRT_SOURCE;

    (void)regs->CLR_TX_ABRT;
    if (source & I2C_ABRT_7B_NOACK)
        return is_reading ? I2C_START_READ_NACK : I2C_START_NACK;
    return source & I2C_ABRT_DATA_NOACK ? I2C_NACK : I2C_TIMEOUT;
}

/* What a transfer has sent, asked for and got. */
struct progress {
    uint32_t n_sent, n_received;
};

/* Next command to the queue; its last one ends the transfer. */
static void queue_command(struct i2c_regs *regs, struct progress *p,
                          uint32_t write_len, uint32_t total,
                          const uint8_t *write)
{
    uint32_t i = p->n_sent++, command;

    if (i < write_len)
        command = write[i];
    else
        command = I2C_CMD_READ
            | (i == write_len && write_len ? I2C_CMD_RESTART : 0);
    regs->DATA_CMD = command | (i + 1 == total ? I2C_CMD_STOP : 0);
}

/* Never more bytes under way than the receiver's queue holds. */
#define QUEUE_SIZE 16

static bool can_queue(struct i2c_regs *regs, const struct progress *p,
                      uint32_t write_len, uint32_t total)
{
    if (p->n_sent == total || !(regs->STATUS & I2C_STATUS_TFNF))
        return false;
    return p->n_sent < write_len
        || p->n_sent - write_len - p->n_received < QUEUE_SIZE;
}

static enum i2c_result run(struct i2c_regs *regs, uint32_t write_len,
                           const uint8_t *write, uint32_t read_len,
                           uint8_t *read)
{
    uint32_t total = write_len + read_len;
    uint32_t limit = QUEUE_SIZE * BYTE_TICKS, last = timer_read_clock();
    struct progress p = { 0, 0 };

    while (!(regs->RAW_INTR_STAT & I2C_INT_STOP_DET)
           || p.n_received < read_len) {
        if (regs->RAW_INTR_STAT & I2C_INT_TX_ABRT)
            break;
        if (can_queue(regs, &p, write_len, total))
            queue_command(regs, &p, write_len, total, write);
        else if (regs->RXFLR)
            read[p.n_received++] = (uint8_t)regs->DATA_CMD;
        else if (timer_read_clock() - last > limit)
            return I2C_TIMEOUT;
        else
            continue;
        last = timer_read_clock();
    }
    /* it ends with a stop, too, and that may have been seen first */
    if (regs->RAW_INTR_STAT & I2C_INT_TX_ABRT)
        return find_cause(regs, p.n_sent > write_len && write_len);
    return I2C_OK;
}

/* Wait for the end of what is under way, or stop it. */
static void end_activity(struct i2c_regs *regs)
{
    uint32_t start = timer_read_clock();

    while (regs->STATUS & I2C_STATUS_MST_ACTIVITY)
        if (timer_read_clock() - start > BYTE_TICKS)
            regs->ENABLE = I2C_ENABLE_ABORT | 1;
    regs->ENABLE = 0;
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    struct i2c_regs *regs = config.regs;
    enum i2c_result result;
    uint8_t probe;

    configure(regs, config.period);
    regs->TAR = config.addr;
    regs->ENABLE = 1;
    (void)regs->CLR_INTR;
    /* it cannot send an address alone */
    if (!write_len && !read_len)
        result = run(regs, 0, NULL, 1, &probe);
    else
        result = run(regs, write_len, write, read_len, read);
    end_activity(regs);
    return result;
}
