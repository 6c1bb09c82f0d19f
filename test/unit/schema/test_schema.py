# SPDX-License-Identifier: GPL-3.0-or-later
"""The JSON Schema of printer.cfg: complete by the facts, true to the samples.

test/data/config_facts.json lists options with type, default and range by section
kind, and those of the kinds of sensors.
"""
import argparse
import ast
import json
import logging
import pathlib

import jsonschema
import pytest

from klippy import extras
from klippy.cli import schema as command
from klippy.configtext import ConfigReader
from klippy.schema import jsonform
from klippy.schema.catalog import read_kind
from klippy.schema.sensors import read_sensor_types
from klippy.schema.texts import read_texts

ROOT = pathlib.Path(__file__).resolve().parents[3]
FACTS = json.loads((ROOT / "test/data/config_facts.json").read_text())
TYPES = {"float": "number", "int": "integer", "bool": "boolean", "str": "string",
         "pin": "string", "template": "string"}
LIMITS = {"minval": "minimum", "maxval": "maximum", "above": "exclusiveMinimum",
          "below": "exclusiveMaximum"}
COMPUTED = {"computed": True}
# Where this host differs from the facts for a reason: option, and what
OTHERWISE = {
    # a probe of the text, which may be a number here already
    ("resistance1", "type"),
    # no pause at all is meaningful
    ("pause_delay", "minval"), ("pause_delay", "above"),
    # zero is of no use and would be divided by
    ("print_width", "minval"), ("print_width", "above"),
    ("maximum_servo_angle", "above"),
}
# Read by helpers that no section here uses yet
UNUSED = {"spi_speed", "spi_software_sclk_pin", "spi_bus"}


@pytest.fixture(scope="module")
def schema(catalog):
    return jsonform.make_schema(catalog.sections, read_texts(),
                                read_sensor_types(catalog.rooms))


@pytest.fixture(scope="module")
def validator(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def fill(name):
    """A name of a kind, as `led x`."""
    return name.replace("<name>", "x").replace("<n>", "2").replace("<letter>", "d")


def find_option(schema, kind, option):
    return jsonform.find_schema(jsonform.find_schema(schema, fill(kind)), fill(option))


def list_facts():
    for kind, options in FACTS["sections"].items():
        for option, fact in options.items():
            yield kind, option, fact
    for options in FACTS["sensors"].values():
        for option, fact in options.items():
            yield "temperature_sensor x", option, fact


def list_variants(fact):
    return [fact, *fact.get("variants", ())]


def test_every_section_loads(catalog):
    assert {room.name: room.errors for room in catalog.rooms if room.errors} == {}


@pytest.mark.parametrize("kind", sorted(FACTS["sections"]))
def test_sections(schema, kind):
    found = jsonform.find_schema(schema, fill(kind))
    assert found
    missing = [option for option in FACTS["sections"][kind]
               if not jsonform.find_schema(found, fill(option))]
    assert missing == []


def test_options_of_sensors(schema):
    missing = {option for options in FACTS["sensors"].values() for option in options
               if not find_option(schema, "temperature_sensor x", option)}
    assert missing == set()


def read_type(found):
    if "enum" in found:
        return "choice"
    if found["type"] == "array":
        return "list"
    return found["type"]


def test_types(schema):
    wrong = []
    for kind, option, fact in list_facts():
        found = find_option(schema, kind, option)
        allowed = {TYPES.get(variant["type"], variant["type"].split("[")[0])
                   for variant in list_variants(fact)}
        if "<name>" in fact.get("choices", ()):
            allowed.add("string")
        if read_type(found) not in allowed and (option, "type") not in OTHERWISE:
            wrong.append((kind, option, read_type(found), allowed))
    assert not wrong, "\n".join(map(str, wrong))


def test_defaults(schema):
    wrong = []
    for kind, option, fact in list_facts():
        found = find_option(schema, kind, option)
        for variant in list_variants(fact):
            wanted = variant.get("default")
            if wanted in (None, []) or found.get("x-default-from") is not None:
                break
            if wanted == COMPUTED or found.get("default") == wanted:
                break
        else:
            wrong.append((kind, option, found.get("default"), fact.get("default")))
    assert not wrong, "\n".join(map(str, wrong))


def test_derived_defaults(schema):
    fan = jsonform.find_schema(schema, "controller_fan x")["properties"]
    assert fan["idle_speed"]["x-default-from"] == ["fan_speed"]
    assert "default" not in fan["idle_speed"]
    axis = schema["properties"]["stepper_x"]["properties"]
    assert axis["second_homing_speed"]["x-default-from"] == ["homing_speed"]
    assert axis["position_max"]["x-exclusiveMinimum-from"] == ["position_min"]
    machine = schema["properties"]["printer"]["properties"]
    assert "max_velocity" in machine["max_z_velocity"]["x-default-from"]


def test_ranges(schema):
    wrong = []
    for kind, option, fact in list_facts():
        found = find_option(schema, kind, option)
        for bound, word in LIMITS.items():
            wanted = [variant.get(bound) for variant in list_variants(fact)]
            value = found.get(word)
            if "x-%s-from" % (word,) in found:
                value = COMPUTED
            is_known = value in wanted or COMPUTED in wanted
            if not is_known and (option, bound) not in OTHERWISE:
                wrong.append((kind, option, bound, value, wanted))
    assert not wrong, "\n".join(map(str, wrong))


def test_choices(schema):
    wrong = []
    for kind, option, fact in list_facts():
        wanted = {choice for variant in list_variants(fact)
                  for choice in variant.get("choices", ())} - {None, "<name>"}
        missing = wanted - set(find_option(schema, kind, option).get("enum", wanted))
        if missing:
            wrong.append((kind, option, missing))
    assert not wrong, "\n".join(map(str, wrong))


def test_required(schema):
    wrong = []
    for kind, option, fact in list_facts():
        found = jsonform.find_schema(schema, fill(kind))
        must = fact["required"] and not fact.get("conditional")
        told = set(found.get("required", ())).union(
            *(condition["then"]["required"] for condition in found.get("allOf", ())))
        if must and "variants" not in fact and option not in told and (
                kind in FACTS["sections"]):
            wrong.append((kind, option))
        if option in found.get("required", ()) and not fact["required"] and not any(
                variant["required"] for variant in list_variants(fact)):
            wrong.append((kind, option, "is not required"))
    assert not wrong, "\n".join(map(str, wrong))


def convert(schema, path):
    return jsonform.convert(ConfigReader().read(str(path)), schema)


@pytest.mark.parametrize("path", sorted(
    [*(ROOT / "config").glob("*.cfg"), *(ROOT / "test").rglob("*.cfg")],
    key=str), ids=lambda path: path.name)
def test_configs_are_valid(schema, validator, path):
    form = convert(schema, path)
    assert form == json.loads(json.dumps(form))
    assert [error.message for error in validator.iter_errors(form)] == []


WRONG = [
    ("printer", "max_velocity", "fast"), ("printer", "max_velocity", "0"),
    ("printer", "max_velocitty", "300"), ("stepper_x", "microsteps", "16.5"),
    ("extruder", "control", "magic"), ("fan", "hardware_pwm", "maybe"),
    ("fan", "max_power", "1.5"), ("stepper_x", "gear_ratio", "3:2:1"),
    ("fann", "pin", "PH6"),
]


@pytest.mark.parametrize("section, option, text", WRONG)
def test_wrong_config_is_found(schema, validator, section, option, text):
    store = ConfigReader().read(str(ROOT / "config/sample-cartesian.cfg"))
    store.set(section, option, text)
    errors = list(validator.iter_errors(jsonform.convert(store, schema)))
    assert len(errors) == 1
    assert section in list(errors[0].path) or section in errors[0].message


MISSING = [("stepper_x", "step_pin"), ("printer", "kinematics"), ("mcu", "serial"),
           ("extruder", "pid_ki"), ("extruder", "sensor_type")]


@pytest.mark.parametrize("section, option", MISSING)
def test_missing_option_is_found(schema, validator, section, option):
    store = ConfigReader().read(str(ROOT / "config/sample-cartesian.cfg"))
    assert store.remove_option(section, option)
    errors = list(validator.iter_errors(jsonform.convert(store, schema)))
    assert [option in error.message for error in errors] == [True]


SENSORS = {kind: sorted(name for name, fact in options.items()
                        if fact["required"] and not name.startswith("sensor_adc"))
           for kind, options in FACTS["sensors"].items() if "<" not in kind}


@pytest.mark.parametrize("kind", sorted(SENSORS))
def test_what_a_sensor_needs(schema, validator, kind):
    """Each type by itself, in a section of its own and in a heater."""
    section = {"sensor_type": kind, "sensor_pin": "PF1", "combination_method": "max",
               "maximum_deviation": 5.0, "sensor_list": ["heater_bed", "extruder"]}

    def list_errors(options, name="temperature_sensor x"):
        part = jsonform.find_schema(schema, name)
        checker = jsonschema.Draft202012Validator(part)
        return [error.message for error in checker.iter_errors(options)
                if error.validator == "required"
                and any(option in error.message for option in section)]
    assert list_errors(section) == list_errors(section, "heater_bed") == []
    for option in SENSORS[kind]:
        rest = {name: value for name, value in section.items() if name != option}
        for name in ("temperature_sensor x", "heater_bed", "extruder"):
            assert list_errors(rest, name) == ["'%s' is a required property" % option]
    alone = {"sensor_type": kind, "sensor_temperature1": 20.0}
    assert len(list_errors(alone)) == len(SENSORS[kind])
    assert jsonschema.Draft202012Validator(jsonform.find_schema(
        schema, "temperature_sensor x")).is_valid({**section, "sensor_adc1": 0.5,
                                                   "sensor_temperature1": 20.0})


def test_sensors_of_the_config_or_of_plug_ins_may_need_anything(schema):
    part = jsonform.find_schema(schema, "temperature_sensor x")
    assert jsonschema.Draft202012Validator(part).is_valid({"sensor_type": "mine"})


def test_conditions(schema, validator):
    store = ConfigReader().read(str(ROOT / "config/sample-cartesian.cfg"))
    for option in ("pid_kp", "pid_ki", "pid_kd"):
        store.remove_option("extruder", option)
    store.set("extruder", "control", "watermark")
    assert validator.is_valid(jsonform.convert(store, schema))


def test_values_in_the_form(schema, tmp_path):
    path = tmp_path / "printer.cfg"
    path.write_text("[stepper_x]\nmicrosteps: 16\nrotation_distance: 40\n"
                    "gear_ratio: 57:11, 2:1\nhoming_positive_dir: no\n"
                    "[gcode_macro A]\nvariable_x: 1\ngcode:\n  G28\n  M84\n")
    assert convert(schema, path) == {
        "stepper_x": {"microsteps": 16, "rotation_distance": 40.,
                      "gear_ratio": [[57., 11.], [2., 1.]],
                      "homing_positive_dir": False},
        "gcode_macro A": {"variable_x": "1", "gcode": "\nG28\nM84"}}


# Nothing is missed: options that stand in the sources as literals

GETTERS = {"get", "getint", "getfloat", "getboolean", "getchoice", "getlist",
           "getlists", "getintlist", "getfloatlist", "load_template"}


def list_literals(path):
    """Names of options in calls like config.getfloat("name")."""
    for node in ast.walk(ast.parse(path.read_text())):
        if (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
                and node.func.attr in GETTERS and node.args):
            owner = ast.unparse(node.func.value)
            place = 1 if node.func.attr == "load_template" else 0
            if "config" in owner.split(".") or node.func.attr == "load_template":
                name = node.args[place] if len(node.args) > place else None
                if isinstance(name, ast.Constant) and isinstance(name.value, str):
                    yield name.value


def test_no_option_of_the_sources_is_missed(catalog):
    known = {name for section in catalog.sections.values() for name in section.options}
    missed = {}
    folders = [pathlib.Path(folder) for folder in extras.BUILTIN_PATHS]
    for path in [*(path for folder in folders for path in folder.glob("*.py")),
                 *(ROOT / "klippy").glob("*.py"),
                 *(ROOT / "klippy/kinematics").glob("*.py"),
                 *(ROOT / "klippy/mcu").glob("*.py")]:
        missing = [name for name in list_literals(path)
                   if name.lower() not in known | UNUSED]
        if missing:
            missed[path.name] = missing
    assert missed == {}


def test_every_option_has_a_line(catalog):
    texts = read_texts()
    missing = []
    for kind, section in catalog.sections.items():
        if section.options and not texts.get_section(kind):
            missing.append(kind)
        missing += [(kind, name) for name, option in section.options.items()
                    if not texts.get_option(kind, option)]
    assert missing == []


def test_plug_ins_are_in(tmp_path, monkeypatch):
    (tmp_path / "my_gadget.py").write_text(
        "def load_config(config):\n"
        "    config.getfloat('turns', above=0., maxval=9.)\n"
        "    config.getchoice('mode', ['slow', 'fast'], 'slow')\n"
        "    return object()\n")
    (tmp_path / "options.toml").write_text(
        "[my_gadget]\nabout = 'A gadget.'\nturns = 'How often.'\n")
    monkeypatch.setattr(extras, "__path__", list(extras.__path__))
    sections = read_kind("my_gadget", [tmp_path]).sections
    found = jsonform.make_schema(sections, read_texts([tmp_path]))
    assert found["properties"]["my_gadget"] == {
        "description": "A gadget.", "type": "object", "required": ["turns"],
        "additionalProperties": False, "properties": {
            "turns": {"description": "How often.", "type": "number",
                      "exclusiveMinimum": 0., "maximum": 9.},
            "mode": {"enum": ["slow", "fast"], "default": "slow"}}}


# The command

def run_command(monkeypatch, catalog, capsys, **given):
    monkeypatch.setattr(command, "read_catalog", lambda folders: catalog)
    monkeypatch.setattr(logging, "disable", lambda level: None)
    given = {"plugins": [], "convert": None, "markdown": None, **given}
    status = command.run(argparse.Namespace(**given))
    return status, *capsys.readouterr()


def test_command_prints_the_schema(monkeypatch, catalog, schema, capsys):
    status, out, err = run_command(monkeypatch, catalog, capsys)
    assert (status, json.loads(out), err) == (0, schema, "")


def test_command_converts(monkeypatch, catalog, validator, capsys):
    status, out, err = run_command(monkeypatch, catalog, capsys, convert=str(
        ROOT / "config/sample-delta.cfg"))
    assert status == 0 and validator.is_valid(json.loads(out))
    assert json.loads(out)["printer"]["kinematics"] == "delta"


def test_command_without_file(monkeypatch, catalog, capsys):
    status, out, err = run_command(monkeypatch, catalog, capsys, convert="no.cfg")
    assert (status, out) == (1, "") and "'no.cfg'" in err
