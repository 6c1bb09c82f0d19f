# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole sessions for the fuzzer to start from, of the objects that it configures.

    python fuzz_seeds.py klipper.dict FOLDER

One message a line, parameters that are left out are 0; `@N` is N ticks after the
start, `wait` lets 40000 ticks pass.  oids are those of fakeboard/fuzz_command.c.
"""

import json
import pathlib
import sys

from simboard import Format

CLOCK = 2**32 - 1 - 100000  # FUZZ_CLOCK
WAIT, CONFIGURED = 64, 128

SESSIONS = {
    "steps": """
        reset_step_clock oid=0 clock=@20000
        queue_step oid=0 interval=300 count=20 add=5
        set_next_step_dir oid=0 dir=1
        queue_step oid=0 interval=900 count=9 add=-20
        reset_step_clock oid=1 clock=@20000
        queue_step oid=1 interval=200 count=40
        stepper_get_position oid=0
        wait
        stepper_get_position oid=1
        wait""",
    "homing": """
        trsync_start oid=4 report_clock=@3000 report_ticks=5000 expire_reason=2
        stepper_stop_on_trigger oid=0 trsync_oid=4
        trsync_set_timeout oid=4 clock=@60000
        endstop_home oid=6 clock=@4000 sample_ticks=50 sample_count=4 rest_ticks=500 \
trsync_oid=4 trigger_reason=1
        reset_step_clock oid=0 clock=@20000
        queue_step oid=0 interval=1000 count=100
        wait
        endstop_query_state oid=6
        trsync_trigger oid=4 reason=3
        wait""",
    "timeout": """
        trsync_start oid=5 report_clock=@3000 report_ticks=5000 expire_reason=2
        stepper_stop_on_trigger oid=1 trsync_oid=5
        trsync_set_timeout oid=5 clock=@30000
        endstop_home oid=6 clock=@4000 sample_ticks=50 sample_count=4 rest_ticks=500 \
pin_value=1 trsync_oid=5 trigger_reason=1
        wait
        wait""",
    "pins": """
        set_digital_out_pwm_cycle oid=2 cycle_ticks=5000
        queue_digital_out oid=2 clock=@9000 on_ticks=2000
        queue_digital_out oid=2 clock=@29000 on_ticks=4000
        queue_digital_out oid=2 clock=@59000
        queue_pwm_out oid=8 clock=@9000 value=100
        queue_pwm_out oid=8 clock=@49000 value=5
        wait
        wait
        update_digital_out oid=3 value=0""",
    "rest": """
        rest_digital_out oid=3
        rest_pwm_out oid=8
        queue_digital_out oid=3 clock=@9000
        queue_pwm_out oid=8 clock=@9000 value=100
        wait
        wait
        wait""",
    "analog": """
        query_analog_in oid=7 clock=@5000 sample_ticks=100 sample_count=3 \
rest_ticks=5000 bytes_per_report=4 max_value=65535 range_check_count=2
        wait
        wait
        query_analog_in oid=7""",
    "buttons": """
        buttons_query oid=9 clock=@5000 rest_ticks=700 retransmit_count=3
        wait
        buttons_ack oid=9 count=1
        query_counter oid=10 clock=@50000 poll_ticks=500 sample_ticks=3000
        wait
        wait""",
    "wires": """
        neopixel_update oid=11 data=000102030405
        neopixel_send oid=11
        tmcuart_send oid=12 write=f1ff05a00c read=10
        wait
        wait
        hd44780_send_cmds oid=18 cmds=0102
        hd44780_send_data oid=18 data=4142
        st7920_send_cmds oid=19 cmds=0102
        st7920_send_data oid=19 data=4142""",
    "buses": """
        spi_transfer oid=13 data=010203
        spi_send oid=14 data=0405
        i2c_transfer oid=15 write=0102 read_len=4
        i2c_transfer oid=16 write=01 read_len=2
        query_thermocouple oid=17 clock=@9000 rest_ticks=9000 max_value=4294967295 \
max_invalid_count=3
        wait
        wait""",
    "accelerometers": """
        query_adxl345 oid=22 rest_ticks=2000
        query_lis2dw oid=23 rest_ticks=2000
        query_mpu9250 oid=24 rest_ticks=2000
        query_icm20948 oid=25 rest_ticks=2000
        query_bmi160 oid=26 rest_ticks=2000
        wait
        query_adxl345_status oid=22
        wait
        query_mpu9250_status oid=24
        query_adxl345 oid=22""",
    "angles": """
        query_spi_angle oid=27 clock=@9000 rest_ticks=4000 time_shift=2
        query_spi_angle oid=28 clock=@9000 rest_ticks=4000
        wait
        spi_angle_transfer oid=27 data=0102
        wait""",
    "load cells": """
        sos_filter_set_offset_scale oid=20 scale=1024 scale_frac_bits=10
        sos_filter_set_section oid=20 sos0=1000 sos1=2000 sos2=1000 sos3=-500 sos4=20
        sos_filter_set_active oid=20 n_sections=1 coeff_frac_bits=12
        trigger_analog_set_raw_range oid=21 raw_min=-9000000 raw_max=9000000
        trigger_analog_set_trigger oid=21 trigger_analog_type=1 trigger_value=5
        trsync_start oid=4 expire_reason=2
        trigger_analog_home oid=21 trsync_oid=4 trigger_reason=1 error_reason=2 \
clock=@3000 monitor_ticks=9000 monitor_max=3
        query_hx71x oid=29 rest_ticks=2000
        query_ads1220 oid=30 rest_ticks=2000
        query_ads131m0x oid=31 rest_ticks=2000
        wait
        query_hx71x_status oid=29
        trigger_analog_query_state oid=21
        wait""",
    "coils": """
        trigger_analog_set_raw_range oid=21 raw_max=900000000
        trigger_analog_set_trigger oid=21 trigger_value=5
        trsync_start oid=4 expire_reason=2
        trigger_analog_home oid=21 trsync_oid=4 trigger_reason=1 error_reason=2 \
clock=@3000
        query_ldc1612 oid=32 rest_ticks=2000
        query_ldc1612 oid=33 rest_ticks=2000
        wait
        query_status_ldc1612 oid=32
        wait""",
    "time": "get_clock\nget_uptime\nget_config\n" + "wait\n" * 60 + "get_uptime",
}


def encode_value(text, kind):
    if kind.endswith("s"):
        return bytes.fromhex(text or "")
    if text and text[0] == "@":
        return (CLOCK + int(text[1:])) % 2**32
    return int(text or 0)


def encode_session(text, forms):
    """The fuzzer's input for a session (fakeboard/fuzz_input.h)."""
    data = b""
    for line in text.split("\n"):
        if not line.strip():
            continue
        name, *words = line.split()
        if name == "wait":
            data += bytes([WAIT | CONFIGURED])
            continue
        values = dict(word.split("=") for word in words)
        form = forms[name]
        assert set(values) <= {key for key, _ in form.params}, line
        message = form.encode({key: encode_value(values.get(key), kind)
                               for key, kind in form.params})
        data += bytes([len(message) | CONFIGURED]) + message
    return data


def write_seeds(dictionary, folder):
    """One file a session."""
    forms = {form.name: form for form in (
        Format(text, number) for text, number in dictionary["commands"].items())}
    for name, text in SESSIONS.items():
        path = folder / ("seed-" + name.replace(" ", "-"))
        path.write_bytes(encode_session(text, forms))


if __name__ == "__main__":
    write_seeds(json.loads(pathlib.Path(sys.argv[1]).read_text()),
                pathlib.Path(sys.argv[2]))
