# SPDX-License-Identifier: GPL-3.0-or-later
"""The declared events: who may say what to the objects of a printer.

Names, arguments and order are an interface for plug-ins, which may also send
events of their own.
"""

from typing import NamedTuple


class Event(NamedTuple):
    """when it is sent, and its arguments with their units."""
    when: str
    payload: tuple[str, ...] = ()


EVENTS = {
    "klippy:mcu_identify": Event(
        "all sections are loaded; the mcus connect and read their dictionaries"),
    "klippy:connect": Event(
        "the mcus are identified; objects look each other up and check the config"),
    "klippy:ready": Event("everything is connected; handlers must not raise"),
    "klippy:shutdown": Event("the printer stops at once; handlers must not raise"),
    "klippy:disconnect": Event("the host ends or restarts; close files and links"),
    "klippy:firmware_restart": Event(
        "the host ends to restart the mcus, before klippy:disconnect"),
    "klippy:analyze_shutdown": Event(
        "after shutdown: log what led to it",
        ("message: str", "details: dict")),
    "klippy:notify_mcu_error": Event(
        "an mcu could not be connected or reported an error",
        ("message: str", "details: dict")),
    "dual_carriage:update_kinematics": Event("another carriage drives an axis"),
    "extruder:activate_extruder": Event("another extruder is the active one"),
    "filament:insert": Event(
        "a sensor sees filament", ("eventtime: s", "sensor: name")),
    "filament:runout": Event(
        "a sensor sees no filament any more", ("eventtime: s", "sensor: name")),
    "gcode:command_error": Event("a G-code command failed"),
    "gcode:debuginput_exit": Event("the file of a batch run is at its end"),
    "gcode:request_restart": Event(
        "a restart was asked for while ready", ("print_time: s",)),
    "homing:home_rails_begin": Event(
        "rails are about to be homed",
        ("homing_state: Homing", "rails: list of PrinterRail")),
    "homing:home_rails_end": Event(
        "rails are homed; handlers may adjust the position",
        ("homing_state: Homing", "rails: list of PrinterRail")),
    "homing:homing_move_begin": Event(
        "a move towards endstops starts", ("homing_move: HomingMove",)),
    "homing:homing_move_end": Event(
        "a move towards endstops is over", ("homing_move: HomingMove",)),
    "idle_timeout:idle": Event("nothing happened for long", ("print_time: s",)),
    "idle_timeout:printing": Event("commands run", ("print_time: s",)),
    "idle_timeout:ready": Event("no command runs any more", ("print_time: s",)),
    "load_cell:calibrate": Event(
        "a load cell is calibrated", ("load_cell: LoadCell",)),
    "load_cell:tare": Event("a load cell is tared", ("load_cell: LoadCell",)),
    "probe:update_results": Event(
        "a probe has results; handlers may correct them in place",
        ("results: list of positions, mm",)),
    "stepper:set_dir_inverted": Event(
        "the direction of a stepper is reversed", ("stepper: MCU_stepper",)),
    "stepper:sync_mcu_position": Event(
        "the position of a stepper was read back from its mcu",
        ("stepper: MCU_stepper",)),
    "stepper_enable:motor_off": Event("the motors are off", ("print_time: s",)),
    "motion_queuing:hold": Event(
        "the host was late: print_time stands still", ("duration: s",)),
    "toolhead:manual_move": Event("the head moved outside the G-code position"),
    "toolhead:set_position": Event("the head's position was set without a move"),
    "toolhead:sync_print_time": Event(
        "print_time jumps ahead after a pause",
        ("eventtime: s", "estimated_print_time: s", "print_time: s")),
    "toolhead:update_extra_axes": Event("an axis beyond x, y, z was added or removed"),
    "virtual_sdcard:reset_file": Event("no file is selected any more"),
}

# Names of which only the beginning is fixed
EVENT_PREFIXES = {
    "danger:non_critical_mcu_": Event(
        "an mcu that may be absent is gone (NAME:disconnected) or back and configured"
        " (NAME:reconnected)"),
    "menu:": Event("a menu was entered or left", ("menu: MenuElement",)),
}


def is_declared(name):
    """True for an event of this table."""
    return name in EVENTS or name.startswith(tuple(EVENT_PREFIXES))
