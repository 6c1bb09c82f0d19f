/* SPDX-License-Identifier: GPL-3.0-or-later
 * LDC1612 inductance converter (eddy current probes): channel 0.
 *
 * A sample is the conversion result as it is read, highest byte first: four
 * error flags and 28 bits.  Registers: data sheet, "Register maps".
 */
#include "board/gpio.h"
#include "bus/i2c_device.h"
#include "core/oid.h"
#include "sensors/bulk.h"
#include "sensors/trigger_analog.h"

enum {
    REG_DATA0_MSB = 0x00, REG_DATA0_LSB = 0x01, REG_STATUS = 0x18,
    STATUS_UNREAD_CHANNEL0 = 0x08, /* in the low byte */
    ERROR_FLAGS = 0xf0,            /* in the first byte of a result */
};

enum { ERROR_SENSOR, ERROR_STATUS, ERROR_DATA, ERROR_INVALID };
DECL_ENUMERATION("ldc1612_error:", "SENSOR_REPORTS_ERROR", 0);
DECL_ENUMERATION("ldc1612_error:", "I2C_STATUS_ERROR", 1);
DECL_ENUMERATION("ldc1612_error:", "I2C_DATA_ERROR", 2);
DECL_ENUMERATION("ldc1612_error:", "INVALID_READ_DATA", 3);

struct ldc1612 {
    struct bulk bulk;
    struct trigger_analog *trigger; /* may be NULL */
    const struct i2c_device *i2c;
    struct gpio_in intb;            /* low: a result is ready */
    bool has_intb;
};

static const ROM struct oid_kind ldc1612_kind = { sizeof(struct ldc1612) };

static struct ldc1612 *from_bulk(struct bulk *bulk)
{
    return CONTAINER_OF(bulk, struct ldc1612, bulk);
}

static bool is_ready(struct bulk *bulk)
{
    struct ldc1612 *l = from_bulk(bulk);

    return !l->has_intb || !gpio_read(l->intb);
}

static bool read_status(struct ldc1612 *l, bool *has_result)
{
    uint8_t status[2];

    *has_result = false;
    if (i2c_device_read(l->i2c, REG_STATUS, sizeof(status), status) != I2C_OK)
        return false;
    *has_result = status[1] & STATUS_UNREAD_CHANNEL0;
    return true;
}

/* The first half holds the second until that is read. */
static bool read_result(struct ldc1612 *l, uint8_t *data)
{
    return i2c_device_read(l->i2c, REG_DATA0_MSB, 2, data) == I2C_OK
           && i2c_device_read(l->i2c, REG_DATA0_LSB, 2, data + 2) == I2C_OK;
}

static void pass_on(struct ldc1612 *l, const uint8_t *data)
{
    int32_t value = (int32_t)((uint32_t)data[0] << 24
                              | (uint32_t)data[1] << 16
                              | (uint32_t)data[2] << 8 | data[3]);

    if (data[0] & ERROR_FLAGS)
        trigger_analog_note_error(l->trigger, ERROR_SENSOR);
    else if (!value)
        trigger_analog_note_error(l->trigger, ERROR_INVALID);
    else
        trigger_analog_update(l->trigger, value);
}

static bool read_sample(struct bulk *bulk)
{
    struct ldc1612 *l = from_bulk(bulk);
    uint8_t data[4];
    bool has_result;

    if (!read_status(l, &has_result)) {
        trigger_analog_note_error(l->trigger, ERROR_STATUS);
        bulk_note_overflow(bulk);
        return false;
    }
    if (!has_result)
        return false;
    if (read_result(l, data)) {
        pass_on(l, data);
    } else {
        trigger_analog_note_error(l->trigger, ERROR_DATA);
        data[0] = data[1] = data[2] = data[3] = 0xff;
    }
    bulk_add(bulk, data);
    return false;
}

static uint16_t count_waiting(struct bulk *bulk)
{
    bool has_result;

    read_status(from_bulk(bulk), &has_result);
    return has_result;
}

static const ROM struct bulk_kind ldc1612_bulk = {
    .sample_size = 4, .is_ready = is_ready, .read = read_sample,
    .count_waiting = count_waiting,
};

static struct ldc1612 *configure(uint8_t oid, uint8_t i2c_oid)
{
    const struct i2c_device *i2c = i2c_device_lookup(i2c_oid);
    struct ldc1612 *l = oid_new(oid, &ldc1612_kind);

    l->i2c = i2c;
    bulk_setup(&l->bulk, &ldc1612_bulk, oid);
    return l;
}

void command_config_ldc1612(const struct args_config_ldc1612 *args)
{
    configure(args->oid, args->i2c_oid);
}
DECL_COMMAND(command_config_ldc1612, "config_ldc1612 oid=%c i2c_oid=%c");

void command_config_ldc1612_with_intb(
    const struct args_config_ldc1612_with_intb *args)
{
    struct gpio_in intb = gpio_setup_input(args->intb_pin, 1);
    struct ldc1612 *l = configure(args->oid, args->i2c_oid);

    l->intb = intb;
    l->has_intb = true;
}
DECL_COMMAND(command_config_ldc1612_with_intb,
             "config_ldc1612_with_intb oid=%c i2c_oid=%c intb_pin=%c");

#if CONFIG_WANT_TRIGGER_ANALOG
void command_ldc1612_attach_trigger_analog(
    const struct args_ldc1612_attach_trigger_analog *args)
{
    struct ldc1612 *l = oid_lookup(args->oid, &ldc1612_kind);

    l->trigger = trigger_analog_lookup(args->trigger_analog_oid);
}
DECL_COMMAND(command_ldc1612_attach_trigger_analog,
             "ldc1612_attach_trigger_analog oid=%c trigger_analog_oid=%c");
#endif

void command_query_ldc1612(const struct args_query_ldc1612 *args)
{
    struct ldc1612 *l = oid_lookup(args->oid, &ldc1612_kind);

    bulk_query(&l->bulk, args->rest_ticks);
}
DECL_COMMAND(command_query_ldc1612, "query_ldc1612 oid=%c rest_ticks=%u");

void command_query_status_ldc1612(const struct args_query_status_ldc1612 *args)
{
    struct ldc1612 *l = oid_lookup(args->oid, &ldc1612_kind);

    bulk_send_status(&l->bulk);
}
DECL_COMMAND(command_query_status_ldc1612, "query_status_ldc1612 oid=%c");
