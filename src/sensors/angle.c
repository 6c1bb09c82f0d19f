/* SPDX-License-Identifier: GPL-3.0-or-later
 * Magnetic angle sensors on SPI: A1333, AS5047D, TLE5012B, MT6816, MT6826S.
 *
 * Sample number n belongs to clock start + n * rest_ticks, whatever happens.
 * It is three bytes: how much later than that the angle was measured (in
 * units of 2^time_shift ticks; TLE5012B: its own frame counter instead), then
 * the angle, 2^16 a turn, low byte first.  255 as the first byte is an error
 * with a code in the second.
 * Frames: the chips' data sheets.
 */
#include <string.h>

#include "board/delay.h"
#include "board/irq.h"
#include "board/timer.h"
#include "bus/spi_device.h"
#include "core/command.h"
#include "core/oid.h"
#include "sensors/bulk.h"

enum { A1333, AS5047D, TLE5012B, MT6816, MT6826S, CHIP_COUNT };
DECL_ENUMERATION("spi_angle_type", "a1333", 0);
DECL_ENUMERATION("spi_angle_type", "as5047d", 1);
DECL_ENUMERATION("spi_angle_type", "tle5012b", 2);
DECL_ENUMERATION("spi_angle_type", "mt6816", 3);
DECL_ENUMERATION("spi_angle_type", "mt6826s", 4);

enum { TIME_ERROR = 0xff, SAMPLE_SIZE = 3 };
enum angle_error {
    ANGLE_OK, ERROR_OVERFLOW, ERROR_LATE, ERROR_SLOW_SPI, ERROR_CRC,
    ERROR_NO_ANGLE,
};
/* Within which the angle was measured, else its time is not known. */
#define FRAME_MAX_US 50

struct angle {
    struct bulk bulk;
    const struct spi_device *spi;
    uint32_t clock;       /* that the next sample belongs to */
    uint8_t chip, time_shift;
};

/* What came of one measurement. */
struct measurement {
    uint32_t clock;
    uint16_t angle;
    uint8_t frame_count;  /* TLE5012B */
};

static const ROM struct oid_kind angle_kind = { sizeof(struct angle) };


/* ---- Checks ---- */

static bool has_even_parity(uint8_t high, uint8_t low)
{
    uint8_t bits = high ^ low;

    bits ^= bits >> 4;
    bits ^= (uint8_t)(bits >> 2);
    return !((bits ^ bits >> 1) & 1);
}

static uint8_t calc_crc8(uint8_t len, const uint8_t *data, uint8_t poly,
                         uint8_t crc)
{
    while (len--) {
        crc ^= *data++;
        for (uint8_t i = 0; i < 8; i++)
            crc = (uint8_t)(crc << 1 ^ (crc & 0x80 ? poly : 0));
    }
    return crc;
}

static uint16_t join(const uint8_t *data)
{
    return (uint16_t)(data[0] << 8 | data[1]);
}


/* ---- Chips ---- */

/* The angle is taken at the start of the frame. */
static enum angle_error transfer_timed(struct angle *a, uint8_t len,
                                       uint8_t *frame, struct measurement *m)
{
    uint32_t start = timer_read_clock();

    spi_device_transfer(a->spi, 1, len, frame);
    m->clock = start;
    return timer_read_clock() - start > timer_from_us(FRAME_MAX_US)
           ? ERROR_SLOW_SPI : ANGLE_OK;
}

/* Each frame carries the answer to the request in the frame before. */
static enum angle_error read_a1333(struct angle *a, struct measurement *m)
{
    uint8_t frame[2] = { 0x32 };
    enum angle_error error = transfer_timed(a, sizeof(frame), frame, m);

    if (frame[0] & 0x80) /* never set by the chip */
        return ERROR_CRC;
    m->angle = (uint16_t)(join(frame) << 1);
    return error;
}

/* Taken when the request ends. */
static enum angle_error read_as5047d(struct angle *a, struct measurement *m)
{
    uint8_t request[2] = { 0x7f, 0xfe }, frame[2] = { 0xc0, 0x00 };
    enum angle_error error = transfer_timed(a, sizeof(request), request, m);

    m->clock = timer_read_clock();
    spi_device_transfer(a->spi, 1, sizeof(frame), frame);
    if (!has_even_parity(frame[0], frame[1]) || (frame[0] & 0x40))
        return ERROR_CRC;
    m->angle = (uint16_t)(join(frame) << 2);
    return error;
}

static enum angle_error read_mt6816(struct angle *a, struct measurement *m)
{
    uint8_t frame[3] = { 0x83 };
    enum angle_error error = transfer_timed(a, sizeof(frame), frame, m);

    if (!has_even_parity(frame[1], frame[2]))
        return ERROR_CRC;
    if (frame[2] & 0x02) /* no magnet */
        return ERROR_NO_ANGLE;
    m->angle = join(frame + 1) & 0xfffc;
    return error;
}

static enum angle_error read_mt6826s(struct angle *a, struct measurement *m)
{
    uint8_t frame[6] = { 0xa0, 0x03 };
    enum angle_error error = transfer_timed(a, sizeof(frame), frame, m);

    if (calc_crc8(3, frame + 2, 0x07, 0) != frame[5])
        return ERROR_CRC;
    if (frame[4] & 0x02) /* weak magnetic field */
        return ERROR_NO_ANGLE;
    m->angle = join(frame + 2) & 0xfffe;
    return error;
}

/* TLE5012B: an empty frame makes the chip take all values at its end.  Returns
 * when that was. */
static uint32_t latch_tle5012b(const struct angle *a)
{
    uint32_t clock;

    spi_device_select(a->spi, true);
    delay_ticks(DELAY_NS(1000));
    irq_disable();
    spi_device_select(a->spi, false);
    clock = timer_read_clock();
    irq_enable();
    delay_ticks(DELAY_NS(1000));
    return clock;
}

/* Angle, speed and revolution registers as latched, and a safety word. */
static enum angle_error read_tle5012b(struct angle *a, struct measurement *m)
{
    uint8_t frame[10] = { 0x84, 0x23 };

    m->clock = latch_tle5012b(a);
    spi_device_transfer(a->spi, 1, sizeof(frame), frame);
    frame[0] = 0x84;
    frame[1] = 0x23; /* the CRC is over the request too */
    if ((calc_crc8(8, frame, 0x1d, 0xff) ^ frame[9]) != 0xff)
        return ERROR_CRC;
    m->angle = (uint16_t)(join(frame + 2) << 1);
    m->frame_count = (frame[6] >> 1) & 0x3f;
    return ANGLE_OK;
}

static enum angle_error measure(struct angle *a, struct measurement *m)
{
    switch (a->chip) {
    case A1333:
        return read_a1333(a, m);
    case AS5047D:
        return read_as5047d(a, m);
    case TLE5012B:
        return read_tle5012b(a, m);
    case MT6816:
        return read_mt6816(a, m);
    default:
        return read_mt6826s(a, m);
    }
}


/* ---- Samples ---- */

static void add_error(struct angle *a, enum angle_error error)
{
    const uint8_t sample[SAMPLE_SIZE] = { TIME_ERROR, (uint8_t)error, 0 };

    bulk_add(&a->bulk, sample);
}

static void add_measurement(struct angle *a, const struct measurement *m)
{
    uint32_t late = (m->clock - a->clock) >> a->time_shift;
    uint8_t sample[SAMPLE_SIZE] = {
        (uint8_t)late, (uint8_t)m->angle, (uint8_t)(m->angle >> 8)
    };

    if (a->chip == TLE5012B)
        sample[0] = m->frame_count;
    else if (late >= TIME_ERROR)
        return add_error(a, ERROR_LATE);
    bulk_add(&a->bulk, sample);
}

static bool read_sample(struct bulk *bulk)
{
    struct angle *a = CONTAINER_OF(bulk, struct angle, bulk);
    struct measurement m;
    enum angle_error error;

    /* A timer event that came late may belong to what has been caught up. */
    if (timer_is_before(timer_read_clock(), a->clock))
        return false;
    while (timer_read_clock() - a->clock >= bulk->rest_ticks) {
        add_error(a, ERROR_OVERFLOW);
        bulk_note_overflow(bulk);
        a->clock += bulk->rest_ticks;
    }
    error = measure(a, &m);
    if (error)
        add_error(a, error);
    else
        add_measurement(a, &m);
    a->clock += bulk->rest_ticks;
    return false;
}

static const ROM struct bulk_kind angle_bulk = {
    .sample_size = SAMPLE_SIZE, .read = read_sample,
};


/* ---- Commands ---- */

void command_config_spi_angle(const struct args_config_spi_angle *args)
{
    const struct spi_device *spi = spi_device_lookup(args->spi_oid);
    struct angle *a;

    if (args->spi_angle_type >= CHIP_COUNT)
        shutdown("Invalid spi_angle chip type");
    if (!spi_device_has_select(spi))
        shutdown("angle sensor requires cs pin");
    a = oid_new(args->oid, &angle_kind);
    a->spi = spi;
    a->chip = args->spi_angle_type;
    bulk_setup(&a->bulk, &angle_bulk, args->oid);
}
DECL_COMMAND(command_config_spi_angle,
             "config_spi_angle oid=%c spi_oid=%c spi_angle_type=%c");

void command_query_spi_angle(const struct args_query_spi_angle *args)
{
    struct angle *a = oid_lookup(args->oid, &angle_kind);
    struct measurement m;

    if (args->time_shift > 31)
        shutdown("Invalid spi_angle time_shift");
    a->clock = args->clock;
    a->time_shift = args->time_shift;
    if (args->rest_ticks && a->chip == A1333)
        read_a1333(a, &m); /* the request for the first sample */
    bulk_query_at(&a->bulk, args->clock, args->rest_ticks);
}
DECL_COMMAND(command_query_spi_angle,
             "query_spi_angle oid=%c clock=%u rest_ticks=%u time_shift=%c");

void command_spi_angle_transfer(const struct args_spi_angle_transfer *args)
{
    struct angle *a = oid_lookup(args->oid, &angle_kind);
    uint8_t data[COMMAND_PAYLOAD_MAX];
    uint32_t clock;

    if (args->data_len > BULK_DATA_MAX)
        shutdown("Invalid spi_angle data length");
    memcpy(data, args->data, args->data_len);
    clock = a->chip == TLE5012B ? latch_tle5012b(a) : timer_read_clock();
    spi_device_transfer(a->spi, 1, args->data_len, data);
    sendf("spi_angle_transfer_response oid=%c clock=%u response=%*s",
          args->oid, clock, args->data_len, data);
}
DECL_COMMAND(command_spi_angle_transfer,
             "spi_angle_transfer oid=%c data=%*s");
