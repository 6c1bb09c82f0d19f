# SPDX-License-Identifier: GPL-3.0-or-later
"""[static_pwm_clock name]: a square wave that runs as long as the mcu does."""

# No timer of a microcontroller makes more than this (Hz)
MAX_FREQUENCY = 520000000
# A period is at most this long (s)
MAX_PERIOD = 0.3


class PrinterStaticPwmClock:
    """Half of each period on: the clock input of another chip."""

    def __init__(self, config):
        ppins = config.get_printer().lookup_object("pins")
        frequency = config.getfloat("frequency", 100.0, above=1.0 / MAX_PERIOD,
                                    maxval=MAX_FREQUENCY)
        pin = ppins.setup_pin("pwm", config.get("pin"))
        pin.setup_max_duration(0.0)
        pin.setup_cycle_time(1.0 / frequency, True)
        pin.setup_start_value(0.5, 0.5)


def load_config_prefix(config):
    return PrinterStaticPwmClock(config)
