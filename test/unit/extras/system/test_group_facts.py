# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing is forgotten: options, defaults, commands, parameters and status of the
groups that a print needs, compared with the facts in test/data/group_facts.json.

A printer with every section of these groups is started; the options it has read, the
commands it knows and the status it shows are compared, name by name.
"""
import json
import pathlib

import pytest
from motion_bench import CARTESIAN, MotionBench

from klippy import gcode_command
from klippy.extras import sensor_tables, thermistor

ROOT = pathlib.Path(__file__).resolve().parents[4]
FACTS = json.loads((ROOT / "test/data/group_facts.json").read_text())
REQUIRED, COMPUTED = "<required>", "<computed>"
EXTRUDER = """
[extruder]
step_pin: PA4
dir_pin: PA6
microsteps: 16
rotation_distance: 32
nozzle_diameter: 0.4
filament_diameter: 1.75
heater_pin: PB4
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PK5
control: watermark
min_temp: 0
max_temp: 300
"""
SENSOR = "sensor_type: PT1000\nsensor_pin: %s\nmin_temp: -50\nmax_temp: 300\n"
# Sections of the printer, each with what must be given; variants of one kind together
# read all of its options
SECTIONS = [
    ("virtual_sdcard", "path: /tmp"), ("pause_resume", ""), ("display_status", ""),
    ("exclude_object", ""), ("idle_timeout", ""), ("respond", ""), ("sdcard_loop", ""),
    ("statistics", ""), ("garbage_collection", ""), ("query_adc", ""),
    ("save_variables", "filename: %(folder)s/variables.cfg"),
    ("delayed_gcode once", "gcode:"), ("homing_heaters", ""),
    ("gcode_macro M", "gcode:\nvariable_name: 1"), ("respond", ""),
    ("heater_bed", SENSOR % "PK1" + "heater_pin: P1\ncontrol: pid\npid_kp: 1\npid_ki: 1"
     "\npid_kd: 1"),
    ("heater_generic a", SENSOR % "PK2" + "heater_pin: P2\ncontrol: watermark"),
    ("heater_generic b", SENSOR % "PK3" + "heater_pin: P3\ncontrol: pid\npid_kp: 1\n"
     "pid_ki: 1\npid_kd: 1"),
    ("verify_heater a", ""),
    ("adc_scaled s", "vref_pin: PK10\nvssa_pin: PK11"),
    ("thermistor points", "temperature1: 25\nresistance1: 100000\ntemperature2: 150\n"
     "resistance2: 1770\ntemperature3: 250\nresistance3: 230"),
    ("thermistor curve", "temperature1: 25\nresistance1: 100000\nbeta: 4000"),
    ("adc_temperature volts", "temperature1: 0\nvoltage1: 1\ntemperature2: 9\n"
     "voltage2: 2"),
    ("adc_temperature ohms", "temperature1: 0\nresistance1: 1\ntemperature2: 9\n"
     "resistance2: 2"),
    ("temperature_sensor t", "sensor_type: PT1000\nsensor_pin: PK20"),
    ("temperature_sensor t1", "sensor_type: curve\nsensor_pin: PK21"),
    ("temperature_sensor t2", "sensor_type: points\nsensor_pin: PK22"),
    ("temperature_sensor t3", "sensor_type: volts\nsensor_pin: PK23"),
    ("temperature_sensor t4", "sensor_type: ohms\nsensor_pin: PK24"),
    ("temperature_sensor t5", "sensor_type: temperature_mcu\nsensor_temperature1: 25\n"
     "sensor_adc1: 0.5\nsensor_temperature2: 50\nsensor_adc2: 0.6"),
    ("temperature_sensor t6", "sensor_type: temperature_host\nsensor_path: "
     "%(folder)s/temp"),
    ("temperature_sensor t7", "sensor_type: temperature_combined\nmaximum_deviation: 99"
     "\nsensor_list: temperature_sensor t\ncombination_method: max"),
    ("temperature_sensor t8", "sensor_type: PT100 INA826\nsensor_pin: PK25"),
    ("fan", "pin: F1\ntachometer_pin: F2"),
    ("heater_fan h", "pin: F3\ntachometer_pin: F4"),
    ("controller_fan c", "pin: F5\ntachometer_pin: F6"),
    ("fan_generic g", "pin: F7\ntachometer_pin: F8"),
    ("temperature_fan w", SENSOR % "PK30" + "pin: F9\ncontrol: watermark\n"
     "tachometer_pin: F10"),
    ("temperature_fan p", SENSOR % "PK31" + "pin: F11\ncontrol: pid\npid_kp: 1\n"
     "pid_ki: 1\npid_kd: 1"),
    ("temperature_fan k", SENSOR % "PK32" + "pin: F12\ncontrol: curve\npoints:\n"
     "  20, 0\n  30, 1"),
    ("output_pin d", "pin: O1"), ("output_pin p", "pin: O2\npwm: True"),
    ("pwm_tool w", "pin: O3"), ("pwm_cycle_time c", "pin: O4"), ("servo s", "pin: O5"),
    ("static_digital_output s", "pins: O6"), ("static_pwm_clock c", "pin: O7"),
    ("multi_pin m", "pins: O8, O9"), ("output_pin m", "pin: multi_pin:m"),
    ("gcode_button b", "pin: I1\npress_gcode:"),
    ("gcode_button a", "pin: I2\npress_gcode:\nanalog_range: 100, 200"),
    ("led l", "red_pin: L1\ngreen_pin: L2\nblue_pin: L3\nwhite_pin: L4"),
    ("neopixel n", "pin: L5"), ("dotstar d", "data_pin: L6\nclock_pin: L7"),
    ("pca9533 f", ""), ("pca9632 c", "i2c_software_scl_pin: L8\n"
                        "i2c_software_sda_pin: L9"),
    ("pca9632 e", "i2c_bus: i2c0"),
    ("pca9533 h", "i2c_software_scl_pin: L8\ni2c_software_sda_pin: L9"),
    ("display_template x", "text: 0\nparam_name: 1"),
    ("filament_switch_sensor s", "switch_pin: I3\nrunout_gcode: M400\n"
     "insert_gcode: M400\nimmediate_runout_gcode: M400"),
    ("filament_motion_sensor m", "switch_pin: I4\nextruder: extruder\n"
     "runout_gcode: M400\ninsert_gcode: M400"),
    ("hall_filament_width_sensor", "adc1: H1\nadc2: H2\n"
     "default_nominal_filament_diameter: 1.75\nmeasurement_delay: 70\n"
     "runout_gcode: M400\ninsert_gcode: M400\nimmediate_runout_gcode: M400"),
    ("board_pins", "aliases: X1=O20"), ("board_pins b", "aliases_name: X2=O21"),
    ("duplicate_pin_override", "pins: O22"), ("duplicate_pin_override n", "pins: O23"),
    ("palette2", "serial: /dev/ttyUSB0"),
]
TSL = ("tsl1401cl_filament_width_sensor", "pin: H3\nmeasurement_delay: 70\n"
       "default_nominal_filament_diameter: 1.75\nmax_difference: 0.2")
# Not of this printer: commands and sections without what they need here
ELSEWHERE = {"tsl1401cl_filament_width_sensor"}
# Sections that are read by the same code
TWINS = {"heater_bed": "heater_generic"}
# A default that differs for a reason
OTHER_DEFAULTS = {
    # a range of its own, checked where it is used
    ("virtual_sdcard", "on_error_gcode"), ("pwm_tool <name>", "maximum_mcu_duration"),
    # no smoothing would be noise; a fan without a limit is one at 0
    ("temperature_fan <name>", "smooth_readings"),
}


def make_config(folder, sections):
    seen, text = set(), CARTESIAN + EXTRUDER
    for name, options in sections:
        if name not in seen:
            seen.add(name)
            text += "[%s]\n%s\n" % (name, options % {"folder": folder})
    return text


@pytest.fixture(scope="module")
def printer(tmp_path_factory):
    """{settings, commands, status, params} of a printer with all sections."""
    folder = tmp_path_factory.mktemp("facts")
    (folder / "temp").write_text("40000\n")
    (folder / "variables.cfg").write_text("[Variables]\n")
    found = {}
    patch = pytest.MonkeyPatch()

    def body(it):
        it.pause(3.0)
        gcode = it.printer.lookup_object("gcode")
        settings = it.get("configfile")["settings"]
        found.update(settings={name: dict(s) for name, s in settings.items()},
                     commands=set(gcode.ready_gcode_handlers))
        found["status"] = {
            name: set(obj.get_status(it.printer.get_reactor().monotonic()))
            for name, obj in it.printer.lookup_objects() if hasattr(obj, "get_status")}
        found["params"] = record_params(it, patch)

    try:
        MotionBench(folder, patch, make_config(folder, SECTIONS)).run_ready(body)
    finally:
        patch.undo()
    return found


def find_kind(name, kinds):
    """The section kind of a section's name, as the facts spell it."""
    head = name.split()[0]
    for kind in (name, head + " <name>", head):
        if kind in kinds and (" " in name) == (" " in kind):
            return kind
    return None


def list_settings(printer, kind):
    """Settings of all sections of a kind, with or without a name, and of its twins."""
    heads = {kind.split()[0], TWINS.get(kind)}
    return [settings for name, settings in printer["settings"].items()
            if name.split()[0] in heads]


@pytest.mark.parametrize("kind", sorted(
    kind for kind in FACTS["sections"] if kind.split()[0] not in ELSEWHERE))
def test_options_and_defaults(printer, kind):
    sections = list_settings(printer, kind)
    facts = FACTS["sections"][kind]
    given = {line.split(":")[0].strip() for name, text in SECTIONS
             if find_kind(name, FACTS["sections"]) == kind for line in text.split("\n")}
    assert sections or not facts
    for option, default in facts.items():
        name = option.replace("<n>", "1").replace("<name>", "name")
        values = [section[name] for section in sections if name in section]
        assert values, "%s is not read" % (option,)
        is_plain = default not in (REQUIRED, COMPUTED) and name not in given
        if is_plain and (kind, option) not in OTHER_DEFAULTS:
            assert is_default(default, values), (option, default, values)


def is_default(default, values):
    """Whether one of the values is the default.

    Null says that nothing is done, which a value of ours (0, an empty text) may say.
    """
    if default is None:
        return True
    if isinstance(default, (int, float)) and not isinstance(default, bool):
        return any(isinstance(value, (int, float)) and abs(value - default) < 1e-9
                   for value in values)
    if isinstance(default, list):
        return any(list(value) == default for value in values if value is not None)
    return default in values


@pytest.mark.parametrize("kind", sorted(FACTS["sensors"]))
def test_options_of_sensors(printer, kind):
    name = {"<name>@adc_temperature": "volts", "<name>@thermistor": "curve"}.get(
        kind, kind)
    table = "PT100 INA826" if name in sensor_tables.voltage_tables() else name
    sections = [s for s in printer["settings"].values()
                if s.get("sensor_type") in (name, name.lower(), table,
                                            "ohms" if name == "volts" else name)]
    assert sections
    for option in FACTS["sensors"][kind]:
        assert any(option in section for section in sections), option


def test_built_in_sensors():
    known = {*thermistor.BUILT_IN, *sensor_tables.voltage_tables(),
             *sensor_tables.resistance_tables()}
    assert known >= set(FACTS["sensor_names"])


@pytest.mark.parametrize("name", sorted(FACTS["commands"]))
def test_commands(printer, name):
    assert name in printer["commands"]


@pytest.mark.parametrize("kind", sorted(
    kind for kind in FACTS["status"] if kind.split()[0] not in ELSEWHERE))
def test_status(printer, kind):
    fields = [status for name, status in printer["status"].items()
              if find_kind(name, FACTS["status"]) == kind]
    assert fields or kind == "gcode_macro <name>"
    for status in fields:
        assert status >= {field for field in FACTS["status"][kind]
                          if not field.startswith("<")}


# Lines that have every parameter of the commands read
LINES = """
SET_LED LED=l RED=1 GREEN=1 BLUE=1 WHITE=1 INDEX=1 TRANSMIT=1 SYNC=1
SET_LED_TEMPLATE LED=l TEMPLATE=x INDEX=1 PARAM_NAME=2
SET_PIN PIN=d TEMPLATE=x
SET_PIN PIN=c VALUE=0 CYCLE_TIME=0.1
SET_PIN PIN=w VALUE=0
SET_FAN_SPEED FAN=g SPEED=0
SET_FAN_SPEED FAN=g TEMPLATE=x
SET_SERVO SERVO=s ANGLE=90
SET_SERVO SERVO=s WIDTH=0.001
SET_TEMPERATURE_FAN_TARGET TEMPERATURE_FAN=w TARGET=30 MIN_SPEED=0 MAX_SPEED=1
SET_FILAMENT_SENSOR SENSOR=s ENABLE=0
QUERY_FILAMENT_SENSOR SENSOR=s
QUERY_FILAMENT_WIDTH
RESET_FILAMENT_WIDTH_SENSOR
QUERY_RAW_FILAMENT_WIDTH
ENABLE_FILAMENT_WIDTH_LOG
DISABLE_FILAMENT_WIDTH_LOG
ENABLE_FILAMENT_WIDTH_SENSOR FLOW_COMPENSATION=1
DISABLE_FILAMENT_WIDTH_SENSOR
QUERY_ADC NAME=t PULLUP=4700
QUERY_BUTTON BUTTON=b
M106 S10
M107
M105
SET_HEATER_TEMPERATURE HEATER=a TARGET=0
TEMPERATURE_WAIT SENSOR="heater_generic a" MINIMUM=0 MAXIMUM=100
TURN_OFF_HEATERS
M140 S0
M190 S0
SET_IDLE_TIMEOUT TIMEOUT=600
SET_PRINT_STATS_INFO TOTAL_LAYER=5 CURRENT_LAYER=1
UPDATE_DELAYED_GCODE ID=once DURATION=0
SAVE_VARIABLE VARIABLE=x VALUE=1
SET_GCODE_VARIABLE MACRO=M VARIABLE=name VALUE=1
RESPOND TYPE=echo PREFIX=a MSG=x
SET_DISPLAY_TEXT MSG=x
M73 P5
""".strip().split("\n")
# Commands of other tests, or that take their words raw
NO_LINE = {"EXCLUDE_OBJECT", "EXCLUDE_OBJECT_DEFINE", "EXCLUDE_OBJECT_END",
           "EXCLUDE_OBJECT_START", "M117", "M118", "M23", "M26", "PID_CALIBRATE",
           "SDCARD_LOOP_BEGIN", "SDCARD_PRINT_FILE", "RESUME"}


def record_params(it, patch):
    """{command: names of the parameters that it asked for}."""
    found, real = {}, gcode_command.GCodeCommand.get

    def get(self, name, *args, **kwargs):
        found.setdefault(self.get_command(), set()).add(name)
        return real(self, name, *args, **kwargs)

    patch.setattr(gcode_command.GCodeCommand, "get", get)
    for line in LINES:
        it.send(line)
    return found


@pytest.mark.parametrize("name", sorted(
    name for name, params in FACTS["commands"].items()
    if params and name not in NO_LINE))
def test_parameters(printer, name):
    assert printer["params"].get(name, set()) >= set(FACTS["commands"][name])


def test_tsl1401cl(tmp_path, monkeypatch):
    def body(it):
        settings = it.get("configfile")["settings"][TSL[0]]
        assert set(settings) == set(FACTS["sections"][TSL[0]])
    MotionBench(tmp_path, monkeypatch, make_config(tmp_path, [TSL])).run_ready(body)
