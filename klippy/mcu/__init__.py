# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects on the micro-controllers: the mcu itself and its simple pins."""

# Plug-ins assign these two; they are read where they are used, at call time.
TRSYNC_TIMEOUT = 0.025
TRSYNC_SINGLE_MCU_TIMEOUT = 0.250

from klippy.errors import McuError  # noqa: E402
from klippy.mcu.adc import MCU_adc  # noqa: E402
from klippy.mcu.commands import (  # noqa: E402
    AsyncCommandWrapper,
    CommandQueryWrapper,
    CommandWrapper,
)
from klippy.mcu.digital_out import MCU_digital_out  # noqa: E402
from klippy.mcu.endstop import MCU_endstop  # noqa: E402
from klippy.mcu.mcu import MCU, add_printer_objects, get, get_printer_mcu  # noqa: E402
from klippy.mcu.pwm import MCU_pwm  # noqa: E402
from klippy.mcu.trigger_dispatch import TriggerDispatch  # noqa: E402
from klippy.mcu.trsync import MCU_trsync  # noqa: E402

error = McuError

__all__ = [
    "MCU", "MCU_adc", "MCU_digital_out", "MCU_endstop", "MCU_pwm", "MCU_trsync",
    "TRSYNC_SINGLE_MCU_TIMEOUT", "TRSYNC_TIMEOUT", "AsyncCommandWrapper",
    "CommandQueryWrapper", "CommandWrapper", "TriggerDispatch",
    "add_printer_objects", "error", "get", "get_printer_mcu"]
