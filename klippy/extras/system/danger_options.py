# SPDX-License-Identifier: GPL-3.0-or-later
"""[danger_options]: what is better left as it is; see klippy.dangers for its users."""

from klippy.dangers import Dangers

# Written to the log unless minimal_logging is set
LOGS = ("log_statistics", "log_config_file_at_startup", "log_velocity_limit_changes",
        "log_pressure_advance_changes", "log_shutdown_info",
        "log_serial_reader_warnings", "log_startup_info")


def read_logs(config):
    """{option: value} of all that is about the log."""
    is_minimal = config.getboolean("minimal_logging", False)
    logs = {name: config.getboolean(name, not is_minimal) for name in LOGS}
    name = "log_webhook_method_register_messages"
    logs[name] = config.getboolean(name, False)
    config.getboolean("log_bed_mesh_at_startup", not is_minimal)
    return logs


def read_times(config):
    """{option: value} of all that is about homing, and about drives."""
    return {
        "single_mcu_trsync_timeout": config.getfloat(
            "single_mcu_trsync_timeout", 0.25, above=0.),
        "multi_mcu_trsync_timeout": config.getfloat(
            "multi_mcu_trsync_timeout", 0.025, above=0.),
        "homing_elapsed_distance_tolerance": config.getfloat(
            "homing_elapsed_distance_tolerance", 0.5, minval=0.),
        "homing_start_delay": config.getfloat("homing_start_delay", 0.001, minval=0.),
        "endstop_sample_time": config.getfloat("endstop_sample_time", 0.000015,
                                               above=0.),
        "endstop_sample_count": config.getint("endstop_sample_count", 4, minval=1),
        "override_pressure_advance_smooth_time_max": config.getfloat(
            "override_pressure_advance_smooth_time_max", 0.2, above=0.)}


def load_config(config):
    """The Dangers of the section."""
    old_name = config.getboolean("adc_ignore_limits", None)
    if old_name is not None:
        config.deprecate("adc_ignore_limits")
    # What has no counterpart here: see docs/kalico.md
    config.getboolean("allow_plugin_override", False)
    config.getfloat("bgflush_extra_time", 0.25, minval=0.)
    return Dangers(
        error_on_unused_config_options=config.getboolean(
            "error_on_unused_config_options", True),
        autosave_includes=config.getboolean("autosave_includes", False),
        temp_ignore_limits=config.getboolean("temp_ignore_limits", bool(old_name)),
        **read_logs(config), **read_times(config))
