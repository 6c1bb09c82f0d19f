/* SPDX-License-Identifier: GPL-3.0-or-later
 * PCA9685: sixteen pwm outputs on I2C, all of one frequency.
 *
 * A timer's event says what is wanted, a task writes it: a transfer takes longer
 * than steps may wait.  Registers: data sheet of NXP, revision 4, 7.3.
 */
#include <time.h>

#include "board/i2c.h"
#include "core/oid.h"
#include "core/sched.h"
#include "io/timed_output.h"

enum { MODE1 = 0x00, MODE2 = 0x01, LED0_ON_L = 0x06, PRE_SCALE = 0xfe };
enum { MODE1_AUTO_INCREMENT = 0x20, MODE1_SLEEP = 0x10, MODE2_TOTEM_POLE = 4 };
/* In the high byte of ON or OFF: for the whole cycle */
enum { FULL = 0x10 };
enum { CHANNELS = 16, CHIPS = 8 };
enum { MIN_PRE_SCALE = 3, MAX_PRE_SCALE = 255 };
#define VALUE_MAX 4096
#define OSCILLATOR_HZ 25000000
#define WAKE_UP_NS 500000
#define I2C_RATE 400000

DECL_CONSTANT("PCA9685_MAX", VALUE_MAX);

struct chip {
    struct i2c_config i2c;
    uint8_t bus, addr;
    uint32_t cycle_ticks; /* 0: not in use */
};

struct pca9685 {
    struct timed_output out;
    struct chip *chip;
    uint16_t value, default_value;
    uint8_t channel;
    bool is_changed; /* the task shall write */
};

static struct chip chips[CHIPS];
static const ROM struct oid_kind pca9685_kind = { sizeof(struct pca9685) };
static struct task_wake pca9685_wake;


/* ---- The chip ---- */

static bool write_register(const struct chip *chip, uint8_t reg, uint8_t value)
{
    const uint8_t data[] = { reg, value };

    return i2c_transfer(chip->i2c, sizeof(data), data, 0, NULL) == I2C_OK;
}

static uint8_t find_pre_scale(uint32_t cycle_ticks)
{
    uint64_t per_cycle = (uint64_t)CONFIG_CLOCK_FREQ * VALUE_MAX;
    uint64_t periods = ((uint64_t)OSCILLATOR_HZ * cycle_ticks + per_cycle / 2)
                       / per_cycle;

    if (periods < MIN_PRE_SCALE + 1)
        return MIN_PRE_SCALE;
    return (uint8_t)(periods > MAX_PRE_SCALE ? MAX_PRE_SCALE : periods - 1);
}

/* The frequency can be set only while it sleeps. */
static bool start_chip(const struct chip *chip)
{
    const struct timespec wake_up = { .tv_nsec = WAKE_UP_NS };

    if (!write_register(chip, MODE1, MODE1_AUTO_INCREMENT | MODE1_SLEEP)
        || !write_register(chip, PRE_SCALE, find_pre_scale(chip->cycle_ticks))
        || !write_register(chip, MODE1, MODE1_AUTO_INCREMENT)
        || !write_register(chip, MODE2, MODE2_TOTEM_POLE))
        return false;
    nanosleep(&wake_up, NULL);
    return true;
}

static struct chip *open_chip(uint8_t bus, uint8_t addr, uint32_t cycle_ticks)
{
    struct chip *chip = chips;

    while (chip < &chips[CHIPS] && chip->cycle_ticks
           && (chip->bus != bus || chip->addr != addr))
        chip++;
    if (chip == &chips[CHIPS] || !cycle_ticks)
        shutdown("Unable to open and init PCA9685 device");
    if (chip->cycle_ticks && chip->cycle_ticks != cycle_ticks)
        shutdown("All PCA9685 channels must have the same cycle_ticks");
    if (chip->cycle_ticks)
        return chip;
    *chip = (struct chip){ .i2c = i2c_setup(bus, I2C_RATE, addr), .bus = bus,
                           .addr = addr, .cycle_ticks = cycle_ticks };
    if (!start_chip(chip)) {
        chip->cycle_ticks = 0;
        shutdown("Unable to open and init PCA9685 device");
    }
    return chip;
}

/* On from count 0 of a cycle to `value`. */
static bool write_channel(const struct chip *chip, uint8_t channel,
                          uint16_t value)
{
    bool is_full = value >= VALUE_MAX, is_part = value && !is_full;
    const uint8_t data[] = {
        (uint8_t)(LED0_ON_L + 4 * channel),
        0, is_full ? FULL : 0,
        is_part ? (uint8_t)value : 0,
        is_part ? (uint8_t)(value >> 8) : value ? 0 : FULL,
    };

    return i2c_transfer(chip->i2c, sizeof(data), data, 0, NULL) == I2C_OK;
}

/* Checks all of it; the channel has that value then. */
static struct chip *set_up_channel(uint8_t bus, uint8_t addr, uint8_t channel,
                                   uint32_t cycle_ticks, uint16_t value)
{
    struct chip *chip;

    if (channel >= CHANNELS || value > VALUE_MAX)
        shutdown("Invalid pca9685 channel or value");
    chip = open_chip(bus, addr, cycle_ticks);
    if (!write_channel(chip, channel, value))
        shutdown("Unable to update PCA9685 value");
    return chip;
}


/* ---- Outputs ---- */

static bool want(struct pca9685 *p, uint16_t value)
{
    p->value = value;
    p->is_changed = true;
    sched_wake(&pca9685_wake);
    return value == p->default_value;
}

static bool apply_value(struct timed_output *out, uint32_t value,
                        uint32_t clock)
{
    (void)clock;
    return want(CONTAINER_OF(out, struct pca9685, out), (uint16_t)value);
}

static void rest(struct timed_output *out)
{
    struct pca9685 *p = CONTAINER_OF(out, struct pca9685, out);

    want(p, p->default_value);
}

static const struct timed_output_kind pca9685_timed_kind = {
    .apply = apply_value,
    .rest = rest,
    .wake = &pca9685_wake,
    .missed = DECL_STRING_ID("Missed scheduling of next pca9685 event"),
    .exceeds = DECL_STRING_ID("Scheduled pca9685 event will exceed max_duration"),
};

void command_config_pca9685(const struct args_config_pca9685 *args)
{
    struct chip *chip;
    struct pca9685 *p;

    if (args->default_value > VALUE_MAX)
        shutdown("Invalid pca9685 channel or value");
    chip = set_up_channel(args->bus, args->addr, args->channel,
                          args->cycle_ticks, args->value);
    p = oid_new(args->oid, &pca9685_kind);
    p->chip = chip;
    p->channel = args->channel;
    p->value = args->value;
    p->default_value = args->default_value;
    timed_output_setup(&p->out, &pca9685_timed_kind, args->max_duration);
    timed_output_start(&p->out, args->value == args->default_value);
}
DECL_COMMAND(command_config_pca9685,
             "config_pca9685 oid=%c bus=%c addr=%c channel=%c cycle_ticks=%u"
             " value=%hu default_value=%hu max_duration=%u");

void command_queue_pca9685_out(const struct args_queue_pca9685_out *args)
{
    struct pca9685 *p = oid_lookup(args->oid, &pca9685_kind);

    if (args->value > VALUE_MAX)
        shutdown("Invalid pca9685 value");
    timed_output_queue(&p->out, args->clock, args->value);
}
DECL_COMMAND(command_queue_pca9685_out,
             "queue_pca9685_out oid=%c clock=%u value=%hu");

/* A channel that needs no object. */
void command_set_pca9685_out(const struct args_set_pca9685_out *args)
{
    set_up_channel(args->bus, args->addr, args->channel, args->cycle_ticks,
                   args->value);
}
DECL_COMMAND(command_set_pca9685_out,
             "set_pca9685_out bus=%c addr=%c channel=%c cycle_ticks=%u"
             " value=%hu");

void pca9685_task(void)
{
    struct pca9685 *p;
    int16_t oid = -1;

    if (!sched_take(&pca9685_wake))
        return;
    while ((p = oid_next(&oid, &pca9685_kind))) {
        if (!p->is_changed)
            continue;
        p->is_changed = false;
        if (!write_channel(p->chip, p->channel, p->value))
            try_shutdown("Unable to update PCA9685 value");
    }
}
DECL_TASK(pca9685_task);

/* Each output has its default, as far as the bus still works. */
void pca9685_shutdown(void)
{
    struct pca9685 *p;
    int16_t oid = -1;

    while ((p = oid_next(&oid, &pca9685_kind))) {
        timed_output_clear(&p->out);
        p->value = p->default_value;
        p->is_changed = false;
        write_channel(p->chip, p->channel, p->value);
    }
}
DECL_SHUTDOWN(pca9685_shutdown);
