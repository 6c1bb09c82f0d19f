# SPDX-License-Identifier: GPL-3.0-or-later
"""Sections as a JSON Schema (draft 2020-12), and configs in the form it is about.

The form of a config: {section: {option: value}}, values typed: numbers, true and
false, lists (nested where the text has two separators), the rest texts.
"""

import re

from klippy.configfile import parse_boolean, parse_float, parse_int
from klippy.schema.merge import KINEMATICS
from klippy.schema.sensors import SENSOR_TYPE, make_sensor_condition

DRAFT = "https://json-schema.org/draft/2020-12/schema"
SENSOR = "sensor"
_TYPES = {"str": "string", "int": "integer", "float": "number", "bool": "boolean"}
_LIMITS = {"minval": "minimum", "maxval": "maximum", "above": "exclusiveMinimum",
           "below": "exclusiveMaximum"}
_PATTERNS = {"<name>": r".+", "<n>": r"[0-9]+", "<letter>": r"[d-w]"}


def make_schema(sections, texts, sensor_types=None):
    """The JSON Schema of a whole printer.cfg.

    sensor_types: as sensors.read_sensor_types() finds them.
    """
    exact, patterns = {}, {}
    sensor = find_sensor_options(sections)
    for kind, section in sections.items():
        target = patterns if "<" in kind else exact
        key = make_pattern(kind) if "<" in kind else kind
        target[key] = make_section(section, sensor, texts, sensor_types or {})
    return {"$schema": DRAFT, "title": "printer.cfg", "type": "object",
            "description": "Values are typed; see klippy schema --convert.",
            "required": ["mcu", "printer"], "properties": exact,
            "patternProperties": patterns, "additionalProperties": False}


def make_pattern(kind):
    """Regular expression for the names of a kind as `led <name>`."""
    if kind == "extruder<n>":
        return r"^extruder[0-9]*$"
    pattern = re.escape(kind).replace("\\ ", " ")
    for mark, expression in _PATTERNS.items():
        pattern = pattern.replace(mark, expression)
    return "^%s$" % (pattern,)


def find_sensor_options(sections):
    """{name: Option} of all kinds of temperature sensors.

    Of the sections that have an option, one where several types of sensors were
    seen tells when it is read.
    """
    found = {}
    for section in sections.values():
        for name, option in section.options.items():
            if section.has_sensor and option.is_of_sensor and (
                    name not in found or option.when):
                found[name] = option
    return found


def list_options(section, sensor):
    """{name: Option} of a section, those of any sensor it may have included."""
    own = {name: option for name, option in section.options.items()
           if not option.is_of_sensor}
    return {**own, **sensor} if section.has_sensor else own


def make_section(section, sensor, texts, sensor_types):
    """The JSON Schema of one section."""
    options = list_options(section, sensor)
    properties, patterns = {}, {}
    for name, option in options.items():
        target = patterns if "<" in name else properties
        key = make_pattern(name) if "<" in name else name
        target[key] = make_option(option, texts.get_option(section.kind, option))
    schema = {"type": "object", "properties": properties,
              "additionalProperties": False}
    about = texts.get_section(section.kind)
    if about:
        schema = {"description": about, **schema}
    if patterns:
        schema["patternProperties"] = patterns
    required = sorted(name for name, option in options.items() if option.needed
                      and option.is_always and not option.is_of_sensor)
    if required:
        schema["required"] = required
    conditions = list(make_conditions(options, sensor_types))
    if conditions:
        schema["allOf"] = conditions
    return schema


def make_option(option, text):
    """The JSON Schema of one option."""
    schema = {"description": text} if text else {}
    schema.update(make_type(option))
    schema.update((_LIMITS[bound], value) for bound, value in option.bounds.items())
    if option.default is not None and "default" not in option.sources:
        schema["default"] = to_plain(option.default)
    for attribute, names in sorted(option.sources.items()):
        schema["x-%s-from" % (_LIMITS.get(attribute, attribute),)] = names
    if option.when is not None:
        schema["x-when"] = option.when
    if option.is_deprecated:
        schema["deprecated"] = True
    return schema


def make_type(option):
    """Type of an option's value."""
    if option.kind == "choice":
        return {"enum": list(option.choices)}
    if option.kind != "list":
        return {"type": _TYPES[option.kind]}
    schema = {"type": _TYPES[option.item]}
    for level, _ in enumerate(option.seps):
        schema = {"type": "array", "items": schema}
        if level == 0 and option.count is not None:
            schema.update(minItems=option.count, maxItems=option.count)
    schema["x-separators"] = list(option.seps)
    return schema


def to_plain(value):
    """A default as JSON has it."""
    return [to_plain(part) for part in value] if isinstance(value, tuple) else value


def make_conditions(options, sensor_types):
    """if/then for the options that must be set in some configs only."""
    for name, option in options.items():
        if (option.is_always or not option.needed or not option.when
                or "<" in name):
            continue
        (key, states), = option.when.items()
        if key not in options or key == KINEMATICS:
            continue
        if key == SENSOR_TYPE:
            condition = make_sensor_condition(states, sensor_types)
        else:
            condition = make_condition(options[key], states)
        yield {"if": condition, "then": {"required": [name]}}


def make_condition(option, states):
    """JSON Schema that holds if an option is in one of some states."""
    name = option.name
    if states == ["set"]:
        return {"required": [name]}
    if states == ["unset"]:
        return {"not": {"required": [name]}}
    values = [state == "True" for state in states] if option.kind == "bool" else states
    if option.kind == "choice" and all(isinstance(c, int) for c in option.choices):
        values = [int(state) for state in states if state != "unset"]
    given = {"properties": {name: {"enum": list(values)}}, "required": [name]}
    if str(option.default) in states or "unset" in states:
        return {"anyOf": [{"not": {"required": [name]}}, given]}
    return given


# Configs

def convert(store, schema):
    """A config (ConfigStore) in the form that a schema is about.

    What is not of its type, or not known, stays the text it is.
    """
    return {name: {option: convert_value(text, find_schema(
                       find_schema(schema, name), option))
                   for option, text in store.items(name)}
            for name in store.sections()}


def find_schema(schema, name):
    """Schema of a property; {} if there is none."""
    if name in schema.get("properties", ()):
        return schema["properties"][name]
    for pattern, found in schema.get("patternProperties", {}).items():
        if re.search(pattern, name):
            return found
    return {}


def convert_value(text, schema):
    """The text of an option as its schema has it."""
    if "enum" in schema:
        is_number = all(isinstance(choice, int) for choice in schema["enum"])
        return _parse(text, parse_int if is_number else str)
    if schema.get("type") == "array":
        return _split(text, schema, schema["x-separators"])
    parsers = {"integer": parse_int, "number": parse_float, "boolean": parse_boolean}
    return _parse(text, parsers.get(schema.get("type"), str))


def _parse(text, parser):
    try:
        return parser(text)
    except (ValueError, OverflowError):
        return text


def _split(text, schema, seps):
    outer, inner = seps[len(seps) - 1], seps[:len(seps) - 1]
    parts = [part.strip() for part in text.split(outer)]
    if inner:
        return [_split(part, schema["items"], inner) for part in parts if part]
    if not parts[len(parts) - 1]:
        parts.pop()
    return [convert_value(part, schema["items"]) for part in parts]
