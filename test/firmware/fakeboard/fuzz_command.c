/* SPDX-License-Identifier: GPL-3.0-or-later
 * Any bytes at the console: nothing may crash, and afterwards the firmware
 * answers.  LLVMFuzzerTestOneInput() serves libFuzzer as well. */
#include <string.h>

#include "board/timer.h"
#include "core/command.h"
#include "core/sched.h"
#include "fakeboard.h"
#include "fuzz_input.h"
#include "fuzz_message.h"
#include "send_command.h"
#include "tests.h"

enum { N_INPUTS = 4000, MAX_INPUT = 400, MAX_EVENTS = 300,
       LONG_TICKS = 40000 };

/* Time passes, unless too much happens in it. */
static void run_for(uint32_t ticks)
{
    uint32_t until = fake.clock + ticks;

    fake_run(until, MAX_EVENTS);
    if (timer_is_before(until, fake.timer))
        fake.clock = until;
}

static void send_values(void *handler, int n, const uint32_t *values)
{
    uint8_t payload[COMMAND_PAYLOAD_MAX];

    fake_send(payload, put_command(payload, handler, n, values));
    run_for(0);
}

static void send_command(void *handler)
{
    send_values(handler, 0, NULL);
}

static void configure_peripherals(void)
{
    SEND(config_buttons, 9, 2);
    SEND(buttons_add, 9, 0, 20, 1);
    SEND(buttons_add, 9, 1, 21, 0);
    SEND(config_counter, 10, 22, 1);
    SEND(config_neopixel, 11, 23, 30, 100, 1000);
    SEND(config_tmcuart, 12, 24, 1, 24, 500);
    SEND(config_spi, 13, 25, 0);
    SEND(spi_set_bus, 13, 0, 0, 1000000);
    SEND(config_spi_without_cs, 14);
    SEND(spi_set_sw_bus, 14, 26, 27, 28, 3, 10);
    SEND(config_i2c, 15);
    SEND(i2c_set_bus, 15, 0, 100000, 80);
    SEND(config_i2c, 16);
    SEND(i2c_set_sw_bus, 16, 29, 30, 10, 81);
    SEND(config_thermocouple, 17, 13, 1);
    SEND(config_hd44780, 18, 31, 32, 33, 34, 35, 36, 100);
    SEND(config_st7920, 19, 37, 38, 39, 100, 100);
}

static void configure_sensors(void)
{
    SEND(config_sos_filter, 20, 3);
    SEND(config_trigger_analog, 21, 20);
    SEND(config_adxl345, 22, 13);
    SEND(config_lis2dw, 23, 14, 0, 1);
    SEND(config_mpu9250, 24, 15);
    SEND(config_icm20948, 25, 16);
    SEND(config_bmi160, 26, 15, 1);
    SEND(config_spi_angle, 27, 13, 2);
    SEND(config_spi_angle, 28, 13, 4);
    SEND(config_hx71x, 29, 4, 40, 41);
    SEND(hx71x_attach_trigger_analog, 29, 21);
    SEND(config_ads1220, 30, 13, 42);
    SEND(ads1220_attach_trigger_analog, 30, 21);
    SEND(config_ads131m0x, 31, 13, 7, 8, 43);
    SEND(config_ldc1612, 32, 15);
    SEND(config_ldc1612_with_intb, 33, 15, 44);
    SEND(ldc1612_attach_trigger_analog, 32, 21);
    SEND(analog_in_attach_trigger_analog, 7, 21);
}

static void configure(void)
{
    SEND(allocate_oids, 40);
    SEND(config_stepper, 0, 10, 11, 0, 100);
    SEND(config_stepper, 1, 12, 13, 255, 0);
    SEND(config_digital_out, 2, 14, 0, 0, 0);
    SEND(config_digital_out, 3, 15, 1, 1, 90000);
    SEND(config_trsync, 4);
    SEND(config_trsync, 5);
    SEND(config_endstop, 6, 16, 1);
    SEND(config_analog_in, 7, 17);
    SEND(config_pwm_out, 8, 18, 1000, 5, 5, 90000);
    configure_peripherals();
    configure_sensors();
    SEND(finalize_config, 1);
}

/* Whatever has happened: end it, and start over without a configuration, at
 * always the same clock. */
static void start_over(void)
{
    uint8_t sync = 0x7e;

    fake.clock = FUZZ_CLOCK;
    fake.timer = FUZZ_CLOCK + (1u << 28);
    fake.is_adc_busy = false;
    fake.n_samples = fake.noise = 0;

    fake.rx_len = 0;
    fake_receive(&sync, 1);
    run_for(0);
    send_command((void *)command_emergency_stop);
    send_command((void *)command_config_reset);
    send_command((void *)command_clear_shutdown);
    fake.n_edges = 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint32_t n_blocks;

    start_over();
    if (size && data[0] & FUZZ_CONFIGURED) {
        configure();
        CHECK(!sched_is_shutdown());
    }
    while (size) {
        size_t len = data[0] & FUZZ_LENGTH;
        bool is_raw = data[0] & FUZZ_RAW;
        data++, size--;
        if (len > size)
            len = size;
        if (len > COMMAND_PAYLOAD_MAX)
            len = COMMAND_PAYLOAD_MAX;
        if (is_raw && !len)
            run_for(LONG_TICKS);
        else if (is_raw ? fake_receive(data, len) : fake_send(data, len))
            run_for(1000);
        data += len, size -= len;
    }
    start_over();
    n_blocks = fake.n_blocks;
    send_command((void *)command_get_clock);
    CHECK(fake.n_blocks >= n_blocks + 2);
    return 0;
}

static bool value_bit(uint32_t *seed)
{
    return next_random(seed) & 1;
}

/* Numbers that may be messages, or plain noise. */
static uint8_t *put_numbers(uint8_t *p, bool is_noise, uint32_t *seed)
{
    const uint8_t *start = p;

    while (p - start < 40 && next_random(seed) % 12) {
        uint32_t value = next_random(seed);
        if (is_noise)
            *p++ = (uint8_t)value;
        else
            p = command_put_int(p, next_random(seed) % 4
                                ? value % 120 : fake.clock + value % 99999);
    }
    return p;
}

/* As many whole messages as fit into a block. */
static uint8_t *put_messages(uint8_t *p, uint32_t *seed)
{
    uint8_t *start = p, *end = p;

    do {
        uint8_t message[2 * FUZZ_MESSAGE_MAX];
        size_t size = (size_t)(fuzz_put_message(message, seed) - message);
        CHECK(size <= FUZZ_MESSAGE_MAX);
        if (end - start + (int)size > COMMAND_PAYLOAD_MAX)
            break;
        memcpy(end, message, size);
        end += size;
    } while (value_bit(seed));
    return end;
}

static size_t make_input(uint8_t *data, uint32_t *seed)
{
    uint8_t configured = value_bit(seed) ? 128 : 0;
    size_t size = 0;

    while (size < MAX_INPUT - 64) {
        uint8_t *start = data + size++, *p = start + 1;
        uint32_t kind = configured ? next_random(seed) % 64 : 60;
        if (kind < 60)
            p = put_messages(p, seed);
        else
            p = put_numbers(p, kind > 61, seed);
        *start = (uint8_t)((p - start - 1) | (kind == 63 ? 64 : 0)
                           | configured);
        size = (size_t)(p - data);
    }
    return size;
}

void fuzz_command(uint32_t seed)
{
    static uint8_t data[MAX_INPUT + 64];

    for (int i = 0; i < N_INPUTS; i++)
        LLVMFuzzerTestOneInput(data, make_input(data, &seed));
    printf("fuzz: %d inputs, %u blocks answered\n", N_INPUTS, fake.n_blocks);
}
