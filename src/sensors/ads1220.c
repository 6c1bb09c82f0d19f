/* SPDX-License-Identifier: GPL-3.0-or-later
 * ADS1220 load cell converter: DRDY falls when a reading is ready, three bytes
 * on SPI fetch it (data sheet, "Data retrieval"). */
#include "board/gpio.h"
#include "bus/spi_device.h"
#include "core/oid.h"
#include "sensors/bulk.h"
#include "sensors/trigger_analog.h"

struct ads1220 {
    struct bulk bulk;
    struct trigger_analog *trigger; /* may be NULL */
    const struct spi_device *spi;
    struct gpio_in data_ready;
};

static const ROM struct oid_kind ads1220_kind = { sizeof(struct ads1220) };

static struct ads1220 *from_bulk(struct bulk *bulk)
{
    return CONTAINER_OF(bulk, struct ads1220, bulk);
}

static bool is_ready(struct bulk *bulk)
{
    return !gpio_read(from_bulk(bulk)->data_ready);
}

static bool read_sample(struct bulk *bulk)
{
    struct ads1220 *a = from_bulk(bulk);
    uint8_t msg[3] = { 0 };
    uint32_t raw;
    int32_t value;

    spi_device_transfer(a->spi, 1, sizeof(msg), msg);
    raw = (uint32_t)msg[0] << 16 | (uint32_t)msg[1] << 8 | msg[2];
    value = (int32_t)(raw << 8) >> 8;
    bulk_add_number(bulk, (uint32_t)value);
    trigger_analog_update(a->trigger, value);
    return false;
}

static uint16_t count_waiting(struct bulk *bulk)
{
    return is_ready(bulk);
}

static const ROM struct bulk_kind ads1220_bulk = {
    .sample_size = 4, .is_ready = is_ready, .read = read_sample,
    .count_waiting = count_waiting,
};

void command_config_ads1220(const struct args_config_ads1220 *args)
{
    const struct spi_device *spi = spi_device_lookup(args->spi_oid);
    struct gpio_in data_ready = gpio_setup_input(args->data_ready_pin, 0);
    struct ads1220 *a = oid_new(args->oid, &ads1220_kind);

    a->spi = spi;
    a->data_ready = data_ready;
    bulk_setup(&a->bulk, &ads1220_bulk, args->oid);
}
DECL_COMMAND(command_config_ads1220,
             "config_ads1220 oid=%c spi_oid=%c data_ready_pin=%u");

#if CONFIG_WANT_TRIGGER_ANALOG
void command_ads1220_attach_trigger_analog(
    const struct args_ads1220_attach_trigger_analog *args)
{
    struct ads1220 *a = oid_lookup(args->oid, &ads1220_kind);

    a->trigger = trigger_analog_lookup(args->trigger_analog_oid);
}
DECL_COMMAND(command_ads1220_attach_trigger_analog,
             "ads1220_attach_trigger_analog oid=%c trigger_analog_oid=%c");
#endif

void command_query_ads1220(const struct args_query_ads1220 *args)
{
    struct ads1220 *a = oid_lookup(args->oid, &ads1220_kind);

    bulk_query(&a->bulk, args->rest_ticks);
}
DECL_COMMAND(command_query_ads1220, "query_ads1220 oid=%c rest_ticks=%u");

void command_query_ads1220_status(const struct args_query_ads1220_status *args)
{
    struct ads1220 *a = oid_lookup(args->oid, &ads1220_kind);

    bulk_send_status(&a->bulk);
}
DECL_COMMAND(command_query_ads1220_status, "query_ads1220_status oid=%c");
