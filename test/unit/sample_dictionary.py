# SPDX-License-Identifier: GPL-3.0-or-later
"""A small dictionary, as a firmware would offer it, for tests of the wire."""

import json
import zlib

DICTIONARY = {
    "app": "Klippy", "version": "v1.2.3", "build_versions": "gcc 12", "license": "GPL",
    "commands": {
        "identify offset=%u count=%c": 1, "get_clock": 2, "get_config": 3,
        "allocate_oids count=%c": 4, "finalize_config crc=%u": 5,
        "config_endstop oid=%c pin=%c pull_up=%c": 6,
        "config_stepper oid=%c step_pin=%c dir_pin=%c invert_step=%c"
        " step_pulse_ticks=%u": 7,
        "queue_step oid=%c interval=%u count=%hu add=%hi": 8,
        "spi_send oid=%c data=%*s": 200, "emergency_stop": 9},
    "responses": {
        "identify_response offset=%u data=%.*s": 0, "clock clock=%u": 20,
        "shutdown clock=%u static_string_id=%hu": 21,
        "stepper_position oid=%c pos=%i": 22,
        "analog_in_state oid=%c next_clock=%u values=%*s": 23},
    "output": {"value %u of %*s is 100%%, 5%": 30},
    "enumerations": {
        "pin": {"PA0": [0, 8], "ADC_TEMPERATURE": 254},
        "static_string_id": {"Timer too close": 2}},
    "config": {"CLOCK_FREQ": 16000000, "ADC_MAX": "4095", "MCU": "toy"}}


def dictionary_json(**changes):
    """The dictionary as bytes of JSON; None as a value leaves a key out."""
    table = dict(DICTIONARY, **changes)
    return json.dumps({k: v for k, v in table.items() if v is not None}).encode()


def dictionary_zlib(**changes):
    """The dictionary as the firmware sends it."""
    return zlib.compress(dictionary_json(**changes))
