/* SPDX-License-Identifier: GPL-3.0-or-later
 * Thermocouple and RTD converters on SPI.
 *
 * Raw readings go to the host.  Too many in a row out of range, or with a
 * fault of the chip, shut the mcu down: the heater may be out of control.
 * Registers: data sheets MAX31855, MAX31856, MAX31865, MAX6675.
 */
#include <stdbool.h>

#include "board/irq.h"
#include "bus/spi_device.h"
#include "core/oid.h"
#include "core/sched.h"

enum { MAX31855, MAX31856, MAX31865, MAX6675, CHIP_COUNT };
DECL_ENUMERATION("thermocouple_type", "MAX31855", 0);
DECL_ENUMERATION("thermocouple_type", "MAX31856", 1);
DECL_ENUMERATION("thermocouple_type", "MAX31865", 2);
DECL_ENUMERATION("thermocouple_type", "MAX6675", 3);

/* How to read a chip.  With registers, the transfer begins with a register's
 * address; else it is all value. */
struct thermocouple_chip {
    uint8_t value_len;
    uint8_t value_reg, fault_reg; /* 0: none, a mask of the value instead */
    uint8_t fault_mask;
};

static const ROM struct thermocouple_chip chips[CHIP_COUNT] = {
    [MAX31855] = { .value_len = 4, .fault_mask = 0x07 },
    [MAX31856] = { .value_len = 3, .value_reg = 0x0c, .fault_reg = 0x0f,
                   .fault_mask = 0xff },
    [MAX31865] = { .value_len = 2, .value_reg = 0x01, .fault_reg = 0x07,
                   .fault_mask = 0xfc },
    [MAX6675] = { .value_len = 2, .fault_mask = 0x06 },
};

struct thermocouple {
    struct timer timer;
    const struct spi_device *spi;
    uint32_t rest_ticks;
    uint32_t min_value, max_value;
    uint8_t chip;
    uint8_t n_invalid, max_invalid; /* readings in a row */
    bool is_due;                    /* the task shall read */
};

static const ROM struct oid_kind thermocouple_kind = {
    sizeof(struct thermocouple)
};
static struct task_wake thermocouple_wake;

static bool reading_event(struct timer *timer)
{
    struct thermocouple *t = CONTAINER_OF(timer, struct thermocouple, timer);

    t->is_due = true;
    sched_wake(&thermocouple_wake);
    timer->waketime += t->rest_ticks;
    return TIMER_AGAIN;
}

void command_config_thermocouple(const struct args_config_thermocouple *args)
{
    const struct spi_device *spi = spi_device_lookup(args->spi_oid);
    struct thermocouple *t;

    if (args->thermocouple_type >= CHIP_COUNT)
        shutdown("Invalid thermocouple chip type");
    t = oid_new(args->oid, &thermocouple_kind);
    t->timer.event = reading_event;
    t->spi = spi;
    t->chip = args->thermocouple_type;
}
DECL_COMMAND(command_config_thermocouple,
             "config_thermocouple oid=%c spi_oid=%c thermocouple_type=%c");

/* rest_ticks=0 stops. */
void command_query_thermocouple(const struct args_query_thermocouple *args)
{
    struct thermocouple *t = oid_lookup(args->oid, &thermocouple_kind);

    sched_del_timer(&t->timer);
    t->is_due = false;
    t->n_invalid = 0;
    if (!args->rest_ticks)
        return;
    t->timer.waketime = args->clock;
    t->rest_ticks = args->rest_ticks;
    t->min_value = args->min_value;
    t->max_value = args->max_value;
    t->max_invalid = args->max_invalid_count;
    sched_add_timer(&t->timer);
}
DECL_COMMAND(command_query_thermocouple,
             "query_thermocouple oid=%c clock=%u rest_ticks=%u min_value=%u"
             " max_value=%u max_invalid_count=%c");

/* `len` bytes, the highest first. */
static uint32_t read_number(const struct thermocouple *t, uint8_t reg,
                            uint8_t len)
{
    uint8_t data[5] = { reg }, skip = reg != 0;
    uint32_t value = 0;

    spi_device_transfer(t->spi, 1, (uint8_t)(len + skip), data);
    for (uint8_t i = skip; i < len + skip; i++)
        value = value << 8 | data[i];
    return value;
}

static uint8_t read_fault(const struct thermocouple *t, uint32_t value)
{
    const ROM struct thermocouple_chip *chip = &chips[t->chip];
    uint8_t fault = (uint8_t)value;

    if (chip->fault_reg)
        fault = (uint8_t)read_number(t, chip->fault_reg, 1);
    fault &= chip->fault_mask;
    if (t->chip == MAX31865 && (value & 1))
        fault |= 1; /* the reading itself is marked as bad */
    return fault;
}

static void check_reading(struct thermocouple *t, uint32_t value,
                          uint8_t fault)
{
    if (!fault && value >= t->min_value && value <= t->max_value) {
        t->n_invalid = 0;
    } else if (++t->n_invalid >= t->max_invalid) {
        t->n_invalid = 0;
        try_shutdown("Thermocouple reader fault");
    }
}

static void take_reading(struct thermocouple *t, uint8_t oid)
{
    const ROM struct thermocouple_chip *chip = &chips[t->chip];
    uint32_t next_clock, value;
    uint8_t fault;

    irq_disable();
    next_clock = t->timer.waketime;
    t->is_due = false;
    irq_enable();
    value = read_number(t, chip->value_reg, chip->value_len);
    fault = read_fault(t, value);
    sendf("thermocouple_result oid=%c next_clock=%u value=%u fault=%c", oid,
          next_clock, value, fault);
    check_reading(t, value, fault);
}

void thermocouple_task(void)
{
    struct thermocouple *t;
    int16_t oid = -1;

    if (!sched_take(&thermocouple_wake))
        return;
    while ((t = oid_next(&oid, &thermocouple_kind)))
        if (t->is_due)
            take_reading(t, (uint8_t)oid);
}
DECL_TASK(thermocouple_task);

void thermocouple_shutdown(void)
{
    struct thermocouple *t;
    int16_t oid = -1;

    while ((t = oid_next(&oid, &thermocouple_kind)))
        t->is_due = false;
}
DECL_SHUTDOWN(thermocouple_shutdown);
