# SPDX-License-Identifier: GPL-3.0-or-later
"""What [danger_options] may change, for the modules that ask: get(printer).

Without that section these are the values.  The section is loaded before all
others, so its values hold from the first constructor on.
"""

from klippy.record import record

SECTION = "danger_options"


@record(frozen=True)
class Dangers:
    """Limits and habits that are best left alone; the section's options by name.

    Of the times None means what the module in question has.
    """
    log_statistics: bool = True
    log_config_file_at_startup: bool = True
    log_velocity_limit_changes: bool = True
    log_pressure_advance_changes: bool = True
    log_shutdown_info: bool = True
    log_serial_reader_warnings: bool = True
    log_startup_info: bool = True
    log_webhook_method_register_messages: bool = False
    error_on_unused_config_options: bool = True
    autosave_includes: bool = False
    temp_ignore_limits: bool = False
    single_mcu_trsync_timeout: float = None
    multi_mcu_trsync_timeout: float = None
    homing_elapsed_distance_tolerance: float = 0.5
    homing_start_delay: float = None
    endstop_sample_time: float = None
    endstop_sample_count: int = None
    override_pressure_advance_smooth_time_max: float = 0.200


_NONE = Dangers()


def get(printer):
    """The Dangers of a printer."""
    return printer.lookup_object(SECTION, _NONE)
