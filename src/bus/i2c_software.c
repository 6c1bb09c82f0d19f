/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C on any pins, bit by bit.  NXP UM10204 sections 3.1.4 to 3.1.9 and 3.1.16
 * (bus clear).
 *
 * Between two calls of these functions the clock is low, except on a bus that
 * is idle.  A line that does not rise ends the transfer.
 */
#include <stdbool.h>

#include "board/delay.h"
#include "board/timer.h"
#include "bus/i2c_software.h"

enum { STRETCH_US = 1000, CLEAR_CLOCKS = 9 };

static void pull(const struct i2c_line *line)
{
    gpio_drive(line->out, 0);
}

static void release(const struct i2c_line *line)
{
    gpio_float(line->in, 1);
}

static void set_data(const struct i2c_software *bus, bool level)
{
    if (level)
        release(&bus->sda);
    else
        pull(&bus->sda);
}

/* Let the clock rise, when the device is ready too. */
static bool raise_clock(const struct i2c_software *bus)
{
    uint32_t start, limit;

    release(&bus->scl);
    if (gpio_read(bus->scl.in))
        return true;
    start = timer_read_clock();
    limit = timer_from_us(STRETCH_US);
    while (!gpio_read(bus->scl.in))
        if (timer_read_clock() - start > limit)
            return false;
    return true;
}

/* One bit both ways: *level is sent, and becomes what the line shows. */
static bool exchange_bit(const struct i2c_software *bus, bool *level)
{
    set_data(bus, *level);
    delay_ticks(bus->pulse_ticks);
    if (!raise_clock(bus))
        return false;
    delay_ticks(bus->pulse_ticks);
    *level = gpio_read(bus->sda.in);
    pull(&bus->scl);
    return true;
}

static bool send_stop(const struct i2c_software *bus)
{
    bool is_raised;

    pull(&bus->sda);
    delay_ticks(bus->pulse_ticks);
    is_raised = raise_clock(bus);
    delay_ticks(bus->pulse_ticks);
    release(&bus->sda);
    delay_ticks(bus->pulse_ticks);
    return is_raised;
}

/* Also a repeated one: both lines rise before data falls. */
static bool send_start(const struct i2c_software *bus)
{
    release(&bus->sda);
    delay_ticks(bus->pulse_ticks);
    if (!raise_clock(bus))
        return false;
    delay_ticks(bus->pulse_ticks);
    pull(&bus->sda);
    delay_ticks(bus->pulse_ticks);
    pull(&bus->scl);
    return true;
}

/* A device that was left in the middle of a byte holds the data line: clock
 * until it lets go. */
static bool clear_bus(const struct i2c_software *bus)
{
    bool level = gpio_read(bus->sda.in);

    if (level)
        return true;
    for (uint8_t i = 0; i < CLEAR_CLOCKS && !level; i++) {
        level = true;
        if (!exchange_bit(bus, &level))
            return false;
    }
    return level && send_stop(bus);
}

static enum i2c_result send_byte(const struct i2c_software *bus, uint8_t byte,
                                 enum i2c_result on_nack)
{
    bool level;

    for (uint8_t mask = 0x80; mask; mask >>= 1) {
        level = byte & mask;
        if (!exchange_bit(bus, &level))
            return I2C_TIMEOUT;
    }
    level = true;
    if (!exchange_bit(bus, &level))
        return I2C_TIMEOUT;
    return level ? on_nack : I2C_OK;
}

/* The last byte is not acknowledged. */
static enum i2c_result receive_byte(const struct i2c_software *bus,
                                    bool is_last, uint8_t *byte)
{
    bool level;

    for (uint8_t n_bits = 8; n_bits; n_bits--) {
        level = true;
        if (!exchange_bit(bus, &level))
            return I2C_TIMEOUT;
        *byte = (uint8_t)(*byte << 1 | level);
    }
    level = is_last;
    return exchange_bit(bus, &level) ? I2C_OK : I2C_TIMEOUT;
}

static enum i2c_result write_bytes(const struct i2c_software *bus,
                                   uint8_t len, const uint8_t *data)
{
    uint8_t address = (uint8_t)(bus->addr << 1);
    enum i2c_result result;

    if (!send_start(bus))
        return I2C_TIMEOUT;
    result = send_byte(bus, address, I2C_START_NACK);
    while (result == I2C_OK && len--)
        result = send_byte(bus, *data++, I2C_NACK);
    return result;
}

static enum i2c_result read_bytes(const struct i2c_software *bus,
                                  uint8_t len, uint8_t *data)
{
    uint8_t address = (uint8_t)(bus->addr << 1 | 1);
    enum i2c_result result;

    if (!send_start(bus))
        return I2C_TIMEOUT;
    result = send_byte(bus, address, I2C_START_READ_NACK);
    for (; result == I2C_OK && len; len--)
        result = receive_byte(bus, len == 1, data++);
    return result;
}

enum i2c_result i2c_software_transfer(const struct i2c_software *bus,
                                      uint8_t write_len, const uint8_t *write,
                                      uint8_t read_len, uint8_t *read)
{
    enum i2c_result result = I2C_OK;

    if (!clear_bus(bus)) {
        release(&bus->scl);
        return I2C_TIMEOUT;
    }
    if (write_len || !read_len)
        result = write_bytes(bus, write_len, write);
    if (result == I2C_OK && read_len)
        result = read_bytes(bus, read_len, read);
    if (!send_stop(bus) && result == I2C_OK)
        result = I2C_TIMEOUT;
    return result;
}

static struct i2c_line setup_line(uint32_t pin)
{
    struct i2c_line line = { .out = gpio_setup_output(pin, 1) };

    line.in = gpio_setup_input(pin, 1);
    return line;
}

struct i2c_software i2c_software_setup(uint32_t scl_pin, uint32_t sda_pin,
                                       uint32_t pulse_ticks, uint8_t addr)
{
    return (struct i2c_software){
        .scl = setup_line(scl_pin), .sda = setup_line(sda_pin),
        .pulse_ticks = pulse_ticks, .addr = addr,
    };
}
