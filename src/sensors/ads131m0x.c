/* SPDX-License-Identifier: GPL-3.0-or-later
 * ADS131M02 to M08 load cell converters (data sheet, "SPI communication
 * frames"): words of 24 bits, first the status, then one a channel, then a
 * CRC-16 over all of that. */
#include "board/gpio.h"
#include "bus/spi_device.h"
#include "core/oid.h"
#include "sensors/bulk.h"
#include "sensors/trigger_analog.h"

enum {
    WORD = 3, CHANNELS_MAX = 8,
    STATUS_RESET = 0x04, /* in the first byte: the chip has been reset */
};

/* A failed reading is sent as this plus its error; beyond all readings. */
#define SAMPLE_ERROR UINT32_C(0x80000000)
enum { ERROR_CRC, ERROR_RESET };
DECL_ENUMERATION("ads131m0x_error:", "SENSOR_ERROR_CRC", 0);
DECL_ENUMERATION("ads131m0x_error:", "SENSOR_ERROR_RESET", 1);

struct ads131m0x {
    struct bulk bulk;
    struct trigger_analog *trigger; /* may be NULL */
    const struct spi_device *spi;
    struct gpio_in data_ready;
    uint8_t channel, n_channels;
};

static const ROM struct oid_kind ads131m0x_kind = {
    sizeof(struct ads131m0x)
};

static struct ads131m0x *from_bulk(struct bulk *bulk)
{
    return CONTAINER_OF(bulk, struct ads131m0x, bulk);
}

static bool is_ready(struct bulk *bulk)
{
    return !gpio_read(from_bulk(bulk)->data_ready);
}

/* Polynomial x^16 + x^12 + x^5 + 1, from all ones; 0 over data and its CRC. */
static uint16_t calc_crc(uint8_t len, const uint8_t *data)
{
    uint16_t crc = 0xffff;

    while (len--) {
        crc = (uint16_t)(crc ^ (uint16_t)(*data++ << 8));
        for (uint8_t i = 0; i < 8; i++)
            crc = (uint16_t)(crc << 1 ^ (crc & 0x8000 ? 0x1021 : 0));
    }
    return crc;
}

static void note_error(struct ads131m0x *a, uint8_t error)
{
    bulk_add_number(&a->bulk, SAMPLE_ERROR + error);
    trigger_analog_note_error(a->trigger, error);
}

/* An empty command brings the readings. */
static bool read_sample(struct bulk *bulk)
{
    struct ads131m0x *a = from_bulk(bulk);
    uint8_t frame[(CHANNELS_MAX + 2) * WORD] = { 0 };
    uint8_t crc_pos = (uint8_t)((a->n_channels + 1) * WORD);
    const uint8_t *word = frame + (a->channel + 1) * WORD;
    int32_t value;

    spi_device_transfer(a->spi, 1, (uint8_t)(crc_pos + WORD), frame);
    if (calc_crc((uint8_t)(crc_pos + 2), frame)) {
        note_error(a, ERROR_CRC);
    } else if (frame[0] & STATUS_RESET) {
        note_error(a, ERROR_RESET);
    } else {
        uint32_t high = (uint32_t)word[0] << 24 | (uint32_t)word[1] << 16;
        value = (int32_t)(high | (uint32_t)word[2] << 8) >> 8;
        bulk_add_number(bulk, (uint32_t)value);
        trigger_analog_update(a->trigger, value);
    }
    return false;
}

static uint16_t count_waiting(struct bulk *bulk)
{
    return is_ready(bulk);
}

static const ROM struct bulk_kind ads131m0x_bulk = {
    .sample_size = 4, .is_ready = is_ready, .read = read_sample,
    .count_waiting = count_waiting,
};

static bool has_model(uint8_t n_channels)
{
    return n_channels == 2 || n_channels == 3 || n_channels == 4
           || n_channels == 6 || n_channels == 8;
}

void command_config_ads131m0x(const struct args_config_ads131m0x *args)
{
    const struct spi_device *spi = spi_device_lookup(args->spi_oid);
    struct gpio_in data_ready;
    struct ads131m0x *a;

    if (!has_model(args->num_channels) || args->channel >= args->num_channels)
        shutdown("Invalid ads131m0x channels configuration");
    data_ready = gpio_setup_input(args->data_ready_pin, 0);
    a = oid_new(args->oid, &ads131m0x_kind);
    a->spi = spi;
    a->data_ready = data_ready;
    a->channel = args->channel;
    a->n_channels = args->num_channels;
    bulk_setup(&a->bulk, &ads131m0x_bulk, args->oid);
}
DECL_COMMAND(command_config_ads131m0x,
             "config_ads131m0x oid=%c spi_oid=%c channel=%c num_channels=%c"
             " data_ready_pin=%u");

#if CONFIG_WANT_TRIGGER_ANALOG
void command_ads131m0x_attach_trigger_analog(
    const struct args_ads131m0x_attach_trigger_analog *args)
{
    struct ads131m0x *a = oid_lookup(args->oid, &ads131m0x_kind);

    a->trigger = trigger_analog_lookup(args->trigger_analog_oid);
}
DECL_COMMAND(command_ads131m0x_attach_trigger_analog,
             "ads131m0x_attach_trigger_analog oid=%c trigger_analog_oid=%c");
#endif

void command_query_ads131m0x(const struct args_query_ads131m0x *args)
{
    struct ads131m0x *a = oid_lookup(args->oid, &ads131m0x_kind);

    bulk_query(&a->bulk, args->rest_ticks);
}
DECL_COMMAND(command_query_ads131m0x, "query_ads131m0x oid=%c rest_ticks=%u");

void command_query_ads131m0x_status(
    const struct args_query_ads131m0x_status *args)
{
    struct ads131m0x *a = oid_lookup(args->oid, &ads131m0x_kind);

    bulk_send_status(&a->bulk);
}
DECL_COMMAND(command_query_ads131m0x_status, "query_ads131m0x_status oid=%c");
