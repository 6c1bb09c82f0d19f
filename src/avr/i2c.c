/* SPDX-License-Identifier: GPL-3.0-or-later
 * I2C: one bus.  ATmega640/1280/2560 data sheet, "TWI"; the registers and
 * status codes are those of all ATmega.
 */
#include <stdbool.h>

#include "board/gpio.h"
#include "board/i2c.h"
#include "board/timer.h"
#include "core/sched.h"

DECL_ENUMERATION("i2c_bus", "twi", 0);
#if CONFIG_AVR_MEGA || CONFIG_AVR_HAS_USB
DECL_CONSTANT_STR("BUS_PINS_twi", "PD0,PD1");
enum { PIN_SCL = 24 + 0, PIN_SDA = 24 + 1 };
#elif CONFIG_AVR_X8
DECL_CONSTANT_STR("BUS_PINS_twi", "PC5,PC4");
enum { PIN_SCL = 16 + 5, PIN_SDA = 16 + 4 };
#else
DECL_CONSTANT_STR("BUS_PINS_twi", "PC0,PC1");
enum { PIN_SCL = 16 + 0, PIN_SDA = 16 + 1 };
#endif

enum {
    BYTE_TIMEOUT_US = 9 * 50,
    STATUS_MASK = 0xf8,
    STATUS_START = 0x08, STATUS_REPEATED_START = 0x10,
    STATUS_WRITE_ACK = 0x18, STATUS_DATA_ACK = 0x28, STATUS_READ_ACK = 0x40,
};

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    uint32_t divisor;

    if (bus || addr > 0x7f)
        shutdown("Unsupported i2c bus");
    divisor = rate ? (CONFIG_CLOCK_FREQ + rate - 1) / rate : UINT16_MAX;
    divisor = divisor > 16 ? (divisor - 16 + 1) / 2 : 0;
    gpio_setup_input(PIN_SCL, 1);
    gpio_setup_input(PIN_SDA, 1);
    return (struct i2c_config){
        .addr = addr, .twbr = (uint8_t)(divisor < 255 ? divisor : 255),
    };
}

/* Start an action and see it through; false if the bus stands still. */
static bool act(uint8_t bits)
{
    uint32_t start = timer_read_clock();
    uint32_t limit = timer_from_us(BYTE_TIMEOUT_US);

    TWCR = (uint8_t)(1 << TWINT | 1 << TWEN | bits);
    while (!(TWCR & (1 << TWINT)))
        if (timer_read_clock() - start > limit)
            return false;
    return true;
}

static enum i2c_result send_byte(uint8_t byte, uint8_t ack_status,
                                 enum i2c_result on_nack)
{
    TWDR = byte;
    if (!act(0))
        return I2C_TIMEOUT;
    return (TWSR & STATUS_MASK) == ack_status ? I2C_OK : on_nack;
}

static enum i2c_result start_with(uint8_t address, uint8_t ack_status,
                                  enum i2c_result on_nack)
{
    uint8_t status;

    if (!act(1 << TWSTA))
        return I2C_TIMEOUT;
    status = TWSR & STATUS_MASK;
    if (status != STATUS_START && status != STATUS_REPEATED_START)
        return I2C_TIMEOUT;
    return send_byte(address, ack_status, on_nack);
}

static enum i2c_result write_bytes(uint8_t addr, uint8_t len,
                                   const uint8_t *data)
{
    enum i2c_result result = start_with((uint8_t)(addr << 1),
                                        STATUS_WRITE_ACK, I2C_START_NACK);

    while (result == I2C_OK && len--)
        result = send_byte(*data++, STATUS_DATA_ACK, I2C_NACK);
    return result;
}

/* All but the last byte are acknowledged. */
static enum i2c_result read_bytes(uint8_t addr, uint8_t len, uint8_t *data)
{
    enum i2c_result result = start_with((uint8_t)(addr << 1 | 1),
                                        STATUS_READ_ACK, I2C_START_READ_NACK);

    for (; result == I2C_OK && len; len--) {
        if (!act(len > 1 ? 1 << TWEA : 0))
            return I2C_TIMEOUT;
        *data++ = TWDR;
    }
    return result;
}

/* TWSTO clears when the stop is on the bus. */
static bool send_stop(void)
{
    uint32_t start = timer_read_clock();
    uint32_t limit = timer_from_us(BYTE_TIMEOUT_US);

    TWCR = 1 << TWINT | 1 << TWEN | 1 << TWSTO;
    while (TWCR & (1 << TWSTO))
        if (timer_read_clock() - start > limit)
            return false;
    return true;
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    enum i2c_result result = I2C_OK;

    TWSR = 0;
    TWBR = config.twbr;
    TWCR = 1 << TWEN;
    if (write_len || !read_len)
        result = write_bytes(config.addr, write_len, write);
    if (result == I2C_OK && read_len)
        result = read_bytes(config.addr, read_len, read);
    if (result == I2C_TIMEOUT || !send_stop()) {
        TWCR = 0; /* let go of the bus at once */
        result = I2C_TIMEOUT;
    }
    return result;
}
