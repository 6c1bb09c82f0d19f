# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole printers with a board whose firmware lacks a feature.

What the printer can do without is out of use, with a reason; it prints.  What heats,
cools, or moves is needed, and keeps it from starting.
"""
import pathlib
import re

import pytest
import reduced_firmware
from machine_configs import BED, make_axes
from printer_run import PrinterRun

from klippy.errors import PrinterError

ROOT = pathlib.Path(__file__).resolve().parents[2]
AUX = "[mcu aux]\nserial: /dev/null\n"
# option -> (sections, commands that fail, objects and what their status has)
BEARABLE = {
    "WANT_NEOPIXEL": (
        "[neopixel strip]\npin: aux:PA2\nchain_count: 2\n",
        ["SET_LED LED=strip RED=1", "SET_LED LED=strip TRANSMIT=0 INDEX=1"],
        {"neopixel strip": {"color_data": [[0., 0., 0., 0.]] * 2}}),
    "WANT_SOFTWARE_SPI": (
        "[dotstar strip]\ndata_pin: aux:PA2\nclock_pin: aux:PA3\n",
        ["SET_LED LED=strip RED=1"], {"dotstar strip": {"color_data": [[0.] * 4]}}),
    "WANT_I2C": (
        "[pca9632 lamp]\ni2c_mcu: aux\n", ["SET_LED LED=lamp RED=1"],
        {"pca9632 lamp": {"color_data": [[0.] * 4]}}),
    "WANT_SOFTWARE_I2C": (
        "[pca9533 lamp]\ni2c_mcu: aux\ni2c_software_scl_pin: aux:PA2\n"
        "i2c_software_sda_pin: aux:PA3\n", ["SET_LED LED=lamp RED=1"],
        {"pca9533 lamp": {"color_data": [[0.] * 4]}}),
    "WANT_HARD_PWM": (
        "[fan_generic blower]\npin: aux:PA0\nhardware_pwm: True\n"
        "enable_pin: aux:PA3\n"
        "[output_pin lamp]\npin: aux:PA1\npwm: True\nhardware_pwm: True\nvalue: 0.5\n"
        "[led bulb]\nwhite_pin: aux:PA2\nhardware_pwm: True\n",
        ["SET_FAN_SPEED FAN=blower SPEED=0.5", "SET_PIN PIN=lamp VALUE=1",
         "SET_LED LED=bulb WHITE=1"],
        {"fan_generic blower": {"speed": 0., "power": 0., "rpm": None},
         "output_pin lamp": {"value": 0.5}, "led bulb": {}}),
    "WANT_BUTTONS": (
        "[gcode_button knob]\npin: ^aux:PA4\npress_gcode:\n"
        "[filament_switch_sensor runout]\nswitch_pin: ^aux:PA3\n"
        "[filament_motion_sensor slip]\nswitch_pin: ^aux:PA5\nextruder: extruder\n"
        "detection_length: 1\n",
        ["QUERY_BUTTON BUTTON=knob", "QUERY_FILAMENT_SENSOR SENSOR=runout",
         "SET_FILAMENT_SENSOR SENSOR=slip ENABLE=1"],
        {"gcode_button knob": {"state": "RELEASED"},
         "filament_switch_sensor runout": {"enabled": False},
         "filament_motion_sensor slip": {"enabled": False}}),
    "WANT_ADC": (
        "[temperature_sensor chamber]\nsensor_type: EPCOS 100K B57560G104F\n"
        "sensor_pin: aux:PE5\nmin_temp: 0\nmax_temp: 100\n"
        "[gcode_button key]\npin: aux:PE6\nanalog_range: 0, 100\npress_gcode:\n"
        "[hall_filament_width_sensor]\nadc1: aux:PE3\nadc2: aux:PE4\n"
        "default_nominal_filament_diameter: 1.75\nmeasurement_delay: 50\n"
        "enable: True\n",
        ['TEMPERATURE_WAIT SENSOR="temperature_sensor chamber" MINIMUM=1',
         "QUERY_ADC NAME=chamber", "QUERY_BUTTON BUTTON=key", "QUERY_FILAMENT_WIDTH",
         "SET_FILAMENT_SENSOR SENSOR=hall_filament_width_sensor ENABLE=1"],
        {"temperature_sensor chamber": {"temperature": None},
         "hall_filament_width_sensor": {"enabled": False, "Diameter": 0.}}),
    "WANT_PULSE_COUNTER": (
        "[fan_generic blower]\npin: aux:PA0\ntachometer_pin: ^aux:PA5\n"
        "[heater_fan hotend]\npin: aux:PA1\ntachometer_pin: ^aux:PA6\n", [],
        {"fan_generic blower": {"rpm": None}, "heater_fan hotend": {"rpm": None}})}
# What the printer must not be without
NEEDED = {
    "heater": ("WANT_ADC", "[heater_generic dryer]\nheater_pin: aux:PF4\n"
               "sensor_type: EPCOS 100K B57560G104F\nsensor_pin: aux:PF5\n"
               "control: watermark\nmin_temp: 0\nmax_temp: 130\n",
               "heater_generic dryer"),
    "heater_fan": ("WANT_HARD_PWM", "[heater_fan hotend]\npin: aux:PA1\n"
                   "hardware_pwm: True\n", "heater_fan hotend"),
    "controller_fan": ("WANT_HARD_PWM", "[controller_fan board]\npin: aux:PA1\n"
                       "hardware_pwm: True\n", "controller_fan board"),
    "temperature_fan": ("WANT_ADC", "[temperature_fan bay]\npin: aux:PA1\n"
                        "sensor_type: EPCOS 100K B57560G104F\nsensor_pin: aux:PE6\n"
                        "min_temp: 0\nmax_temp: 100\ncontrol: watermark\n",
                        "temperature_fan bay"),
    "pwm_tool": ("WANT_HARD_PWM", "[pwm_tool laser]\npin: aux:PA1\n"
                 "hardware_pwm: True\n", "pwm_tool laser")}
JOB = "G28\nG1 X30 Y30 Z5 F6000\nG1 X60 E3 F1200\nM106 S100\nM400\nG4 P4000\nM107"


# Without timed switching of pins, which all firmware of this project has
SOFT_PWM = (
    "[servo arm]\npin: aux:PA0\n[pwm_cycle_time tone]\npin: aux:PA1\n"
    "[output_pin lamp]\npin: aux:PA2\npwm: True\n[fan_generic blower]\npin: aux:PA3\n",
    ["SET_SERVO SERVO=arm WIDTH=0.0015", "SET_PIN PIN=tone VALUE=0.5",
     "SET_PIN PIN=lamp VALUE=1", "SET_FAN_SPEED FAN=blower SPEED=1"],
    {"servo arm": {"value": 0.}, "pwm_cycle_time tone": {"value": 0.},
     "output_pin lamp": {"value": 0.}, "fan_generic blower": {"speed": 0.}})
VOLTS = ("[tsl1401cl_filament_width_sensor]\npin: aux:PE3\nmax_difference: 0.2\n"
         "default_nominal_filament_diameter: 1.75\nmeasurement_delay: 50\n",
         ["QUERY_FILAMENT_WIDTH", "ENABLE_FILAMENT_WIDTH_SENSOR"], {})


def make_config(sections):
    return make_axes("cartesian", extra=BED + AUX + sections)


def get_status(printer, name):
    return printer.lookup_object(name).get_status(printer.get_reactor().monotonic())


def check_out_of_use(printer, commands, reason, statuses):
    """Commands fail with the reason; statuses {name: fields} have these fields."""
    for command in commands:
        check_fails(printer, command, reason)
    for name, wanted in statuses.items():
        status = get_status(printer, name)
        assert {key: status[key] for key in wanted} == wanted


def check_fails(printer, command, option):
    with pytest.raises(PrinterError, match="cannot be used.*" + option):
        printer.lookup_object("gcode").run_script(command)


@pytest.mark.parametrize("option", BEARABLE)
def test_prints_without(tmp_path, monkeypatch, option):
    sections, commands, statuses = BEARABLE[option]
    reduced_firmware.patch(
        monkeypatch, lambda table: reduced_firmware.remove(table, {option}), (1,))

    def look(printer):
        assert printer.get_state_message()[1] == "ready"
        warnings = [warning["message"] for warning in
                    get_status(printer, "configfile")["warnings"]]
        names = re.findall(r"^\[(.+)\]$", sections, re.MULTILINE)
        assert len(warnings) == len(names) - (option == "WANT_BUTTONS") * 2
        for name in names:
            assert any("[%s] at " % (name,) in text and option in text
                       and "mcu 'aux'" in text for text in warnings), name
        check_out_of_use(printer, commands, option, statuses)
        if option == "WANT_HARD_PWM":
            # macros that turn it off go on
            printer.lookup_object("gcode").run_script(
                "SET_FAN_SPEED FAN=blower SPEED=0")

    def look_again(printer):
        assert printer.get_state_message()[1] == "ready"
        assert get_status(printer, "toolhead")["position"][:2] == (60., 30.)
        if option == "WANT_PULSE_COUNTER":
            printer.lookup_object("gcode").run_script(
                "SET_FAN_SPEED FAN=blower SPEED=0.5\nG4 P1000\nM400")
            assert get_status(printer, "fan_generic blower")["power"] == 0.5

    run = PrinterRun(make_config(sections), tmp_path)
    run.run([look, JOB, look_again])
    assert not run.count_late_events()


def remove_command(monkeypatch, command, mcu):
    """Have an mcu lack one command, whatever it is built with."""
    def change(table):
        for text in list(table["commands"]):
            if text.split()[0] == command:
                del table["commands"][text]
        return table
    reduced_firmware.patch(monkeypatch, change, (mcu,))


@pytest.mark.parametrize("row, command", [
    (SOFT_PWM, "set_digital_out_pwm_cycle"), (VOLTS, "query_analog_in")])
def test_prints_without_a_command(tmp_path, monkeypatch, row, command):
    sections, commands, statuses = row
    remove_command(monkeypatch, command, 1)

    def look(printer):
        check_out_of_use(printer, commands, command, statuses)
    config = make_config(sections + "[output_pin plain]\npin: aux:PB7\n")
    PrinterRun(config, tmp_path).run([look, JOB, "SET_PIN PIN=plain VALUE=1"])


def test_every_bearable_kind_is_tried():
    kinds = {path.stem for path in (ROOT / "klippy" / "extras").glob("*/*.py")
             if "\nMAY_LACK_FIRMWARE = True\n" in path.read_text()}
    tried = {kind for sections, _, _ in (*BEARABLE.values(), SOFT_PWM, VOLTS)
             for kind in re.findall(r"^\[(\w+)", sections, re.MULTILINE)}
    assert kinds == (tried - {"heater_fan"}) | {"fan"}


@pytest.mark.parametrize("what", NEEDED)
def test_does_not_start_without(tmp_path, monkeypatch, what):
    option, sections, name = NEEDED[what]
    reduced_firmware.patch(
        monkeypatch, lambda table: reduced_firmware.remove(table, {option}), (1,))
    with pytest.raises(PrinterError, match=re.escape(
            "The printer cannot run without [%s] at " % (name,))) as info:
        PrinterRun(make_config(sections), tmp_path).run([])
    assert "(%s)" % (option,) in str(info.value)
    if option == "WANT_HARD_PWM":
        assert "or set hardware_pwm: False" in str(info.value)


@pytest.mark.parametrize("command, section", [
    ("config_stepper", "stepper_x"), ("config_endstop", "stepper_x"),
    ("config_trsync", "stepper_x"), ("trsync_start", "stepper_x"),
    ("endstop_home", "stepper_x"), ("config_analog_in", "extruder")])
def test_motion_and_heat_are_needed(tmp_path, monkeypatch, command, section):
    """Whatever the reason: these are in every firmware."""
    remove_command(monkeypatch, command, 0)
    with pytest.raises(PrinterError, match=r"(?s)cannot run without .*%s.* at"
                       r" .*printer\.cfg" % (section,)) as info:
        PrinterRun(make_config(""), tmp_path).run([])
    assert "lacks the command '%s'" % (command,) in str(info.value)


def test_part_fan_is_off_without_an_error(tmp_path, monkeypatch):
    """M107 and M106 S0 stand in the macros that end a print."""
    reduced_firmware.patch(
        monkeypatch, lambda table: reduced_firmware.remove(table, {"WANT_HARD_PWM"}))

    def look(printer):
        run_script = printer.lookup_object("gcode").run_script
        run_script("M107\nM106 S0")
        check_fails(printer, "M106 S255", "WANT_HARD_PWM")
        check_fails(printer, "M106", "WANT_HARD_PWM")
        assert get_status(printer, "fan")["speed"] == 0.
    PrinterRun(make_axes("cartesian", extra=BED + "hardware_pwm: True\n"),
               tmp_path).run([look])


def test_fan_of_two_boards(tmp_path, monkeypatch):
    """One of its pins is out of use, and so is the fan."""
    reduced_firmware.patch(
        monkeypatch, lambda table: reduced_firmware.remove(table, {"WANT_HARD_PWM"}),
        (1,))
    sections = ("[multi_pin both]\npins: PB7, aux:PA0\n[fan_generic blower]\n"
                "pin: multi_pin:both\nhardware_pwm: True\n")

    def look(printer):
        check_fails(printer, "SET_FAN_SPEED FAN=blower SPEED=1", "WANT_HARD_PWM")
        check_fails(printer, "SET_FAN_SPEED FAN=blower TEMPLATE=x", "WANT_HARD_PWM")
        printer.lookup_object("gcode").run_script("SET_FAN_SPEED FAN=blower SPEED=0")
    PrinterRun(make_config(sections), tmp_path).run([look])


def test_sensor_that_another_one_is_made_of(tmp_path, monkeypatch):
    """A combined sensor is not one that guesses."""
    sensor = ("[temperature_sensor chamber]\nsensor_type: EPCOS 100K B57560G104F\n"
              "sensor_pin: aux:PE5\n[temperature_sensor both]\nsensor_type:"
              " temperature_combined\nsensor_list: extruder, temperature_sensor"
              " chamber\ncombination_method: max\nmaximum_deviation: 50\n")
    reduced_firmware.patch(
        monkeypatch, lambda table: reduced_firmware.remove(table, {"WANT_ADC"}), (1,))
    with pytest.raises(PrinterError, match="'sensor_list' in section"
                       " 'temperature_sensor both' .*chamber.* cannot be used"):
        PrinterRun(make_config(sensor), tmp_path).run([])
