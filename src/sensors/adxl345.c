/* SPDX-License-Identifier: GPL-3.0-or-later
 * ADXL345 accelerometer on SPI, read from its FIFO (data sheet, "FIFO").
 *
 * The host sets the registers up: full resolution, FIFO in stream mode.  One
 * burst reads the oldest sample and then the FIFO's registers, which tell
 * what is left and, as their contents are known, whether the transfer was
 * sound.  A sample goes out as five bytes: the low bytes of x, y and z, then
 * two with five bits above for x and y, and those of z split among them.
 */
#include "bus/spi_device.h"
#include "core/oid.h"
#include "sensors/bulk.h"

enum {
    SPI_READ_MANY = 0xc0, SPI_READ = 0x80,
    REG_DATAX0 = 0x32, REG_FIFO_STATUS = 0x39,
    FIFO_CTL_STREAM = 0x80,  /* as the host has set it */
    FIFO_COUNT_MASK = 0x3f, FIFO_SIZE = 32,
    SAMPLE_SIZE = 5,
};

struct adxl345 {
    struct bulk bulk;
    const struct spi_device *spi;
    uint8_t n_waiting; /* samples, as far as is known */
};

static const ROM struct oid_kind adxl345_kind = { sizeof(struct adxl345) };

static uint8_t read_count(const struct adxl345 *a)
{
    uint8_t msg[2] = { SPI_READ | REG_FIFO_STATUS };

    spi_device_transfer(a->spi, 1, sizeof(msg), msg);
    return msg[1] & FIFO_COUNT_MASK;
}

/* High bytes of 13 bit numbers repeat their sign in the upper bits. */
static bool is_sound(uint8_t high)
{
    return (high & 0xf0) == 0 || (high & 0xf0) == 0xf0;
}

static void add_sample(struct adxl345 *a, const uint8_t *axes, bool is_good)
{
    uint8_t z = axes[5] & 0x1f;
    uint8_t sample[SAMPLE_SIZE] = {
        axes[0], axes[2], axes[4],
        (uint8_t)((axes[1] & 0x1f) | z << 5),
        (uint8_t)((axes[3] & 0x1f) | (z >> 3) << 5),
    };

    if (!is_good)
        for (uint8_t i = 0; i < SAMPLE_SIZE; i++)
            sample[i] = 0xff;
    bulk_add(&a->bulk, sample);
}

static bool read_sample(struct bulk *bulk)
{
    struct adxl345 *a = CONTAINER_OF(bulk, struct adxl345, bulk);
    uint8_t msg[9] = { SPI_READ_MANY | REG_DATAX0 }, count;
    bool is_good;

    if (!a->n_waiting) {
        a->n_waiting = read_count(a);
        if (a->n_waiting >= FIFO_SIZE - 1)
            bulk_note_overflow(bulk);
        return a->n_waiting != 0;
    }
    spi_device_transfer(a->spi, 1, sizeof(msg), msg);
    count = msg[8] & FIFO_COUNT_MASK;
    is_good = is_sound(msg[2]) && is_sound(msg[4]) && is_sound(msg[6])
              && msg[7] == FIFO_CTL_STREAM && count <= FIFO_SIZE;
    add_sample(a, msg + 1, is_good);
    a->n_waiting = is_good ? count : 0;
    if (is_good && count >= FIFO_SIZE - 1)
        bulk_note_overflow(bulk);
    return a->n_waiting != 0;
}

static uint16_t count_waiting(struct bulk *bulk)
{
    uint8_t count = read_count(CONTAINER_OF(bulk, struct adxl345, bulk));

    if (count >= FIFO_SIZE - 1)
        bulk_note_overflow(bulk);
    return count;
}

static const ROM struct bulk_kind adxl345_bulk = {
    .sample_size = SAMPLE_SIZE, .read = read_sample,
    .count_waiting = count_waiting,
};

void command_config_adxl345(const struct args_config_adxl345 *args)
{
    const struct spi_device *spi = spi_device_lookup(args->spi_oid);
    struct adxl345 *a = oid_new(args->oid, &adxl345_kind);

    a->spi = spi;
    bulk_setup(&a->bulk, &adxl345_bulk, args->oid);
}
DECL_COMMAND(command_config_adxl345, "config_adxl345 oid=%c spi_oid=%c");

void command_query_adxl345(const struct args_query_adxl345 *args)
{
    struct adxl345 *a = oid_lookup(args->oid, &adxl345_kind);

    a->n_waiting = 0;
    bulk_query(&a->bulk, args->rest_ticks);
}
DECL_COMMAND(command_query_adxl345, "query_adxl345 oid=%c rest_ticks=%u");

void command_query_adxl345_status(const struct args_query_adxl345_status *args)
{
    struct adxl345 *a = oid_lookup(args->oid, &adxl345_kind);

    bulk_send_status(&a->bulk);
}
DECL_COMMAND(command_query_adxl345_status, "query_adxl345_status oid=%c");
