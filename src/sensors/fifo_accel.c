/* SPDX-License-Identifier: GPL-3.0-or-later
 * Accelerometers that keep samples of three 16 bit numbers in a FIFO: LIS2DW,
 * LIS3DH, MPU-9250 and relatives, ICM-20948, BMI160.
 *
 * The host sets the registers up and knows the order of the bytes; here it
 * takes a count and a burst.  Registers: data sheets, chapters on the FIFO.
 * A sensor that does not answer costs samples, not the print.
 */
#include "bus/i2c_device.h"
#include "core/oid.h"
#include "sensors/bulk.h"
#include "sensors/register_bus.h"

enum {
    SAMPLE_SIZE = 6,
    BURST_MAX = REGISTER_BUS_READ_MAX / SAMPLE_SIZE, /* samples */
};

struct fifo_chip {
    struct register_flags flags; /* that a read needs */
    uint8_t data_reg;
    uint8_t count_reg;
    uint8_t count_len;      /* bytes; 1: counts samples, 2: bytes */
    bool is_count_big;      /* the high byte comes first */
    uint8_t burst_max;      /* samples at once */
    uint16_t count_mask;
    uint16_t full;          /* a count of this means lost samples ... */
    uint8_t overflow_reg;   /* ... or these bits here do */
    uint8_t overflow_mask;
};

enum { LIS2DW, LIS3DH, LIS_COUNT };
#if CONFIG_WANT_LIS2DW
DECL_ENUMERATION("lis_chip_type", "LIS2DW", 0);
DECL_ENUMERATION("lis_chip_type", "LIS3DH", 1);

static const ROM struct fifo_chip lis_chips[LIS_COUNT] = {
    [LIS2DW] = { .flags = { .spi = 0x80 }, .data_reg = 0x28,
                 .count_reg = 0x2f, .count_len = 1, .count_mask = 0x3f,
                 .full = 32, .burst_max = 1, .overflow_reg = 0x2f,
                 .overflow_mask = 0x40 },
    [LIS3DH] = { .flags = { .spi = 0xc0, .i2c = 0x80 }, .data_reg = 0x28,
                 .count_reg = 0x2f, .count_len = 1, .count_mask = 0x1f,
                 .full = 32, .burst_max = 1, .overflow_reg = 0x2f,
                 .overflow_mask = 0x40 },
};
#endif

#if CONFIG_WANT_MPU9250
static const ROM struct fifo_chip mpu9250_chip = {
    .data_reg = 0x74, .count_reg = 0x72, .count_len = 2, .is_count_big = true,
    .count_mask = 0x1fff, .full = UINT16_MAX, .burst_max = BURST_MAX,
    .overflow_reg = 0x3a, .overflow_mask = 0x10,
};
#endif

#if CONFIG_WANT_ICM20948
static const ROM struct fifo_chip icm20948_chip = {
    .data_reg = 0x72, .count_reg = 0x70, .count_len = 2, .is_count_big = true,
    .count_mask = 0x1fff, .full = UINT16_MAX, .burst_max = BURST_MAX,
    .overflow_reg = 0x1b, .overflow_mask = 0x1f,
};
#endif

#if CONFIG_WANT_BMI160
static const ROM struct fifo_chip bmi160_chip = {
    .flags = { .spi = 0x80 }, .data_reg = 0x24, .count_reg = 0x22,
    .count_len = 2, .count_mask = 0x07ff, .full = 1024 - SAMPLE_SIZE + 1,
    .burst_max = BURST_MAX,
};
#endif

struct fifo_accel {
    struct bulk bulk;
    struct register_bus bus;
    const ROM struct fifo_chip *chip;
    uint16_t n_waiting; /* samples, as far as is known */
};

static bool read_registers(const struct fifo_accel *a, uint8_t reg,
                           uint8_t len, uint8_t *data)
{
    return register_bus_read(&a->bus, reg, a->chip->flags, len, data);
}

/* Samples in the FIFO; notes whether it has run over. */
static uint16_t read_count(struct fifo_accel *a)
{
    const ROM struct fifo_chip *chip = a->chip;
    uint8_t raw[2] = { 0 }, status = 0;
    uint16_t count;

    if (!read_registers(a, chip->count_reg, chip->count_len, raw)) {
        bulk_note_overflow(&a->bulk);
        return 0;
    }
    count = (uint16_t)(raw[chip->is_count_big] | raw[!chip->is_count_big] << 8);
    if (chip->overflow_reg == chip->count_reg)
        status = raw[0];
    else if (chip->overflow_reg)
        read_registers(a, chip->overflow_reg, 1, &status);
    count &= chip->count_mask;
    if (count >= chip->full || (status & chip->overflow_mask))
        bulk_note_overflow(&a->bulk);
    return chip->count_len == 1 ? count : count / SAMPLE_SIZE;
}

static bool read_samples(struct bulk *bulk)
{
    struct fifo_accel *a = CONTAINER_OF(bulk, struct fifo_accel, bulk);
    uint8_t data[REGISTER_BUS_READ_MAX], count = a->chip->burst_max;

    if (!a->n_waiting) {
        a->n_waiting = read_count(a);
        return a->n_waiting != 0;
    }
    if (count > a->n_waiting)
        count = (uint8_t)a->n_waiting;
    if (!read_registers(a, a->chip->data_reg, (uint8_t)(count * SAMPLE_SIZE),
                        data)) {
        bulk_note_overflow(bulk);
        a->n_waiting = 0;
        return false;
    }
    for (uint8_t i = 0; i < count; i++)
        bulk_add(bulk, data + i * SAMPLE_SIZE);
    a->n_waiting = (uint16_t)(a->n_waiting - count);
    return true;
}

static uint16_t count_waiting(struct bulk *bulk)
{
    return read_count(CONTAINER_OF(bulk, struct fifo_accel, bulk));
}

static const ROM struct bulk_kind fifo_accel_bulk = {
    .sample_size = SAMPLE_SIZE, .read = read_samples,
    .count_waiting = count_waiting,
};

static void configure(uint8_t oid, const ROM struct oid_kind *kind,
                      const ROM struct fifo_chip *chip,
                      struct register_bus bus)
{
    struct fifo_accel *a = oid_new(oid, kind);

    a->bus = bus;
    a->chip = chip;
    bulk_setup(&a->bulk, &fifo_accel_bulk, oid);
}

static void query(uint8_t oid, const ROM struct oid_kind *kind,
                  uint32_t rest_ticks)
{
    struct fifo_accel *a = oid_lookup(oid, kind);

    a->n_waiting = 0;
    bulk_query(&a->bulk, rest_ticks);
}

static void query_status(uint8_t oid, const ROM struct oid_kind *kind)
{
    struct fifo_accel *a = oid_lookup(oid, kind);

    bulk_send_status(&a->bulk);
}


/* ---- Commands: one set a chip ---- */

#if CONFIG_WANT_LIS2DW
static const ROM struct oid_kind lis_kind = { sizeof(struct fifo_accel) };

void command_config_lis2dw(const struct args_config_lis2dw *args)
{
    if (args->lis_chip_type >= LIS_COUNT)
        shutdown("model type invalid");
    configure(args->oid, &lis_kind, &lis_chips[args->lis_chip_type],
              register_bus_lookup(args->bus_oid_type, args->bus_oid));
}
DECL_COMMAND(command_config_lis2dw,
             "config_lis2dw oid=%c bus_oid=%c bus_oid_type=%c"
             " lis_chip_type=%c");

void command_query_lis2dw(const struct args_query_lis2dw *args)
{
    query(args->oid, &lis_kind, args->rest_ticks);
}
DECL_COMMAND(command_query_lis2dw, "query_lis2dw oid=%c rest_ticks=%u");

void command_query_lis2dw_status(const struct args_query_lis2dw_status *args)
{
    query_status(args->oid, &lis_kind);
}
DECL_COMMAND(command_query_lis2dw_status, "query_lis2dw_status oid=%c");
#endif

#if CONFIG_WANT_MPU9250
static const ROM struct oid_kind mpu9250_kind = { sizeof(struct fifo_accel) };

void command_config_mpu9250(const struct args_config_mpu9250 *args)
{
    configure(args->oid, &mpu9250_kind, &mpu9250_chip,
              register_bus_lookup(REGISTER_BUS_I2C, args->i2c_oid));
}
DECL_COMMAND(command_config_mpu9250, "config_mpu9250 oid=%c i2c_oid=%c");

void command_query_mpu9250(const struct args_query_mpu9250 *args)
{
    query(args->oid, &mpu9250_kind, args->rest_ticks);
}
DECL_COMMAND(command_query_mpu9250, "query_mpu9250 oid=%c rest_ticks=%u");

void command_query_mpu9250_status(const struct args_query_mpu9250_status *args)
{
    query_status(args->oid, &mpu9250_kind);
}
DECL_COMMAND(command_query_mpu9250_status, "query_mpu9250_status oid=%c");
#endif

#if CONFIG_WANT_ICM20948
static const ROM struct oid_kind icm20948_kind = { sizeof(struct fifo_accel) };

void command_config_icm20948(const struct args_config_icm20948 *args)
{
    configure(args->oid, &icm20948_kind, &icm20948_chip,
              register_bus_lookup(REGISTER_BUS_I2C, args->i2c_oid));
}
DECL_COMMAND(command_config_icm20948, "config_icm20948 oid=%c i2c_oid=%c");

void command_query_icm20948(const struct args_query_icm20948 *args)
{
    query(args->oid, &icm20948_kind, args->rest_ticks);
}
DECL_COMMAND(command_query_icm20948, "query_icm20948 oid=%c rest_ticks=%u");

void command_query_icm20948_status(
    const struct args_query_icm20948_status *args)
{
    query_status(args->oid, &icm20948_kind);
}
DECL_COMMAND(command_query_icm20948_status, "query_icm20948_status oid=%c");
#endif

#if CONFIG_WANT_BMI160
static const ROM struct oid_kind bmi160_kind = { sizeof(struct fifo_accel) };

void command_config_bmi160(const struct args_config_bmi160 *args)
{
    configure(args->oid, &bmi160_kind, &bmi160_chip,
              register_bus_lookup(args->bus_oid_type, args->bus_oid));
}
DECL_COMMAND(command_config_bmi160,
             "config_bmi160 oid=%c bus_oid=%c bus_oid_type=%c");

void command_query_bmi160(const struct args_query_bmi160 *args)
{
    query(args->oid, &bmi160_kind, args->rest_ticks);
}
DECL_COMMAND(command_query_bmi160, "query_bmi160 oid=%c rest_ticks=%u");

void command_query_bmi160_status(const struct args_query_bmi160_status *args)
{
    query_status(args->oid, &bmi160_kind);
}
DECL_COMMAND(command_query_bmi160_status, "query_bmi160_status oid=%c");
#endif
