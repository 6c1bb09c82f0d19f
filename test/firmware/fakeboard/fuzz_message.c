/* SPDX-License-Identifier: GPL-3.0-or-later
 * Messages for the fuzzer that get past the first checks: the right number of
 * parameters, and mostly objects that exist and are of the right kind. */
#include "core/command.h"
#include "core/tables.h"
#include "fakeboard.h"
#include "fuzz_message.h"
#include "send_command.h"
#include "tests.h"

struct known_command {
    void *handler;
    uint8_t oid;
};

#define KNOWN(NAME, OID) { (void *)command_##NAME, OID }

/* What a configured mcu is asked for; oids as in fuzz_command.c. */
static const struct known_command known[] = {
    KNOWN(queue_step, 0), KNOWN(set_next_step_dir, 0),
    KNOWN(reset_step_clock, 0), KNOWN(queue_step, 1),
    KNOWN(stepper_stop_on_trigger, 0), KNOWN(stepper_get_position, 1),
    KNOWN(queue_digital_out, 2), KNOWN(set_digital_out_pwm_cycle, 2),
    KNOWN(update_digital_out, 3), KNOWN(trsync_start, 4),
    KNOWN(trsync_set_timeout, 4), KNOWN(trsync_trigger, 5),
    KNOWN(endstop_home, 6), KNOWN(query_analog_in, 7),
    KNOWN(queue_pwm_out, 8), KNOWN(buttons_query, 9), KNOWN(buttons_ack, 9),
    KNOWN(query_counter, 10), KNOWN(neopixel_update, 11),
    KNOWN(neopixel_send, 11), KNOWN(tmcuart_send, 12),
    KNOWN(spi_transfer, 13), KNOWN(spi_send, 14), KNOWN(spi_transfer, 14),
    KNOWN(i2c_transfer, 15), KNOWN(i2c_transfer, 16),
    KNOWN(query_thermocouple, 17), KNOWN(hd44780_send_cmds, 18),
    KNOWN(hd44780_send_data, 18), KNOWN(st7920_send_cmds, 19),
    KNOWN(st7920_send_data, 19), KNOWN(sos_filter_set_section, 20),
    KNOWN(sos_filter_set_state, 20), KNOWN(sos_filter_set_offset_scale, 20),
    KNOWN(sos_filter_set_active, 20), KNOWN(trigger_analog_home, 21),
    KNOWN(trigger_analog_set_raw_range, 21),
    KNOWN(trigger_analog_set_trigger, 21),
    KNOWN(trigger_analog_query_state, 21), KNOWN(query_adxl345, 22),
    KNOWN(query_adxl345_status, 22), KNOWN(query_lis2dw, 23),
    KNOWN(query_lis2dw_status, 23), KNOWN(query_mpu9250, 24),
    KNOWN(query_mpu9250_status, 24), KNOWN(query_icm20948, 25),
    KNOWN(query_icm20948_status, 25), KNOWN(query_bmi160, 26),
    KNOWN(query_bmi160_status, 26), KNOWN(query_spi_angle, 27),
    KNOWN(spi_angle_transfer, 27), KNOWN(query_spi_angle, 28),
    KNOWN(query_hx71x, 29), KNOWN(query_hx71x_status, 29),
    KNOWN(query_ads1220, 30), KNOWN(query_ads1220_status, 30),
    KNOWN(query_ads131m0x, 31), KNOWN(query_ads131m0x_status, 31),
    KNOWN(query_ldc1612, 32), KNOWN(query_status_ldc1612, 32),
    KNOWN(query_ldc1612, 33),
};
#define N_KNOWN (sizeof(known) / sizeof(known[0]))

static uint32_t make_number(uint32_t *seed)
{
    uint32_t value = next_random(seed);

    switch (next_random(seed) % 8) {
    case 0:
        return value << 8 | (value & 255);
    case 1:
    case 2:
        return fake.clock + value % 3000;
    case 3:
        return value % 5000;
    default:
        return value % 12;
    }
}

static uint8_t *put_buffer(uint8_t *p, uint8_t room, uint32_t *seed)
{
    uint8_t len = (uint8_t)(next_random(seed) % room);

    *p++ = len;
    while (len--)
        *p++ = (uint8_t)next_random(seed);
    return p;
}

uint32_t fuzz_pick_command(uint8_t *oid, uint32_t *seed)
{
    const struct known_command *pick = &known[next_random(seed) % N_KNOWN];

    *oid = pick->oid;
    return find_command(pick->handler);
}

uint8_t *fuzz_put_message(uint8_t *p, uint32_t *seed)
{
    uint8_t oid, n = 0;
    uint32_t id = fuzz_pick_command(&oid, seed);
    const struct command_entry *entry = &tables_commands[id];

    p = command_put_int(p, id);
    if (next_random(seed) % 32) {
        p = command_put_int(p, oid);
        n++;
    }
    for (; n < entry->n_params; n++)
        p = entry->buffers & (1 << n) ? put_buffer(p, 12, seed)
                                      : command_put_int(p, make_number(seed));
    return p;
}
