# SPDX-License-Identifier: GPL-3.0-or-later
"""The references of docs/: sections with options, commands with parameters."""

import importlib.util
import pathlib

from klippy.schema.jsonform import find_sensor_options
from klippy.schema.merge import EXTRUDER, KINEMATICS
from klippy.schema.parameters import LIVE
from klippy.schema.texts import FREE

# Chapters: title, and folders of klippy/extras or core modules they are made of
CHAPTERS = (
    ("The machine", ("printer", "stepper", "carriage", "dual_carriage",
                     "extra_carriage", "mcu", "toolhead", "kinematics")),
    ("Extruders", ("extruder",)),
    ("Moving", ("motion",)),
    ("Homing", ("home",)),
    ("Heating", ("heating",)),
    ("Temperature sensors", ("thermometry",)),
    ("Fans", ("cooling",)),
    ("Filament sensors", ("filament",)),
    ("Printing", ("printing",)),
    ("Outputs and buttons", ("outputs",)),
    ("Lights and templates", ("lights", "panels")),
    ("Probing and levelling", ("probing", "leveling")),
    ("Drivers, boards, system", ("drivers", "boards", "vibration", "sampling",
                                 "system", "services")),
    ("Plug-ins", ("",)),
)
GENERATED = ("<!-- Written by `make docs`: change the modules or the .toml beside"
             " them. -->")
OPTION_HEAD = ["", "| Option | Value | Default | Meaning |", "|---|---|---|---|"]
PARAMETER_HEAD = ["", "| Parameter | Value | Default | Meaning |", "|---|---|---|---|"]
MAX_CHOICES_SHOWN = 12
_WORDS = {"str": "text", "int": "whole number", "float": "number", "bool": "yes or no",
          "list": "list"}
_SIGNS = (("minval", "≥"), ("above", ">"), ("maxval", "≤"), ("below", "<"))


def find_folder(module):
    """Folder of klippy/extras (or of the core) a module is in; "" for plug-ins."""
    spec = importlib.util.find_spec("klippy.extras." + module)
    if spec is not None and spec.origin:
        folder = pathlib.Path(spec.origin).parent
        return folder.name if folder.parent.name == "extras" else ""
    for package, name in (("klippy.kinematics.", "kinematics"),
                          ("klippy.", "services")):
        if importlib.util.find_spec(package + module) is not None:
            return module if module in ("extruder", "toolhead") else name
    return ""


def find_chapter(head):
    """Title of the chapter for a section kind's first word or a module."""
    for title, parts in CHAPTERS:
        if head in parts:
            return title
    folder = find_folder(head)
    return next(title for title, parts in CHAPTERS if folder in parts)


# Config

def write_config(sections, texts):
    """Text of config_reference.md."""
    sensor = find_sensor_options(sections)
    chapters = {}
    for kind, section in sections.items():
        if not section.options and texts.get_section(kind) is None:
            continue                # loaded by others, nobody writes it
        head = kind.split()[0].replace("<n>", "")
        if head.startswith("stepper"):
            head = "stepper"
        chapters.setdefault(find_chapter(head), []).append(kind)
    lines = [GENERATED, "# Config reference", "", CONFIG_HEAD]
    for title, _ in CHAPTERS:
        if title in chapters:
            lines += ["", "## " + title]
            lines += list_sections(chapters[title], sections, texts)
        if title == "Temperature sensors":
            lines += list_sensor_options(sections, sensor, texts)
    return "\n".join(lines) + "\n"


CONFIG_HEAD = """\
All sections of `printer.cfg` and their options. **Bold** options must be set. A value
in parentheses is a limit or default in words. `<name>` is a name you choose.

Sections of kinds that are not here come from plug-ins. `klippy check printer.cfg` tells
what is wrong in a config, `klippy schema` prints all this for programs."""


def list_sections(kinds, sections, texts):
    """Lines of sections; those with the same lines are told once."""
    bodies = {}
    for kind in sorted(kinds, key=lambda kind: (kind != "printer", kind)):
        body = tuple(list_body(sections[kind], texts))
        bodies.setdefault(body, []).append(kind)
    lines = []
    for body, names in bodies.items():
        lines += ["", "### " + ", ".join("[%s]" % (
            "extruder" if name == EXTRUDER else name,) for name in names), *body]
    return lines


def list_body(section, texts):
    """Lines below the heading of a section."""
    about = texts.get_section(section.kind)
    lines = [about] if about else []
    options = [option for option in section.options.values() if not option.is_of_sensor]
    rows = [write_option(option, texts.get_option(section.kind, option))
            for option in options]
    if rows:
        lines += [*OPTION_HEAD, *rows]
    if section.has_sensor:
        lines += ["", "And the options of its sensor:"
                      " [Sensors](#options-of-sensors)."]
    return lines


def list_sensor_options(sections, sensor, texts):
    """Lines of the options that depend on sensor_type."""
    owner = next(kind for kind, section in sections.items() if section.has_sensor)
    return ["", "### Options of sensors",
            "They belong into the section that has `sensor_type`.", *OPTION_HEAD,
            *(write_option(option, texts.get_option(owner, option))
              for _, option in sorted(sensor.items()))]


def write_option(option, text):
    """Row of a table about an option."""
    name = "`%s`" % (option.name,)
    if option.needed and (option.is_always or option.is_of_sensor or option.when):
        name = "**%s**" % (name,)
    meaning = escape(text or "")
    condition = describe_condition(option)
    if condition:
        meaning = "%s %s" % (meaning, condition)
    if option.is_deprecated:
        meaning += " Will go away."
    return "| %s | %s | %s | %s |" % (name, describe_value(option),
                                      describe_default(option), meaning.strip())


def describe_value(option):
    """Type and range of an option."""
    if option.kind == "choice":
        shown = ["`%s`" % (choice,) for choice in option.choices]
        if len(shown) > MAX_CHOICES_SHOWN:
            return "text"
        return ", ".join(shown)
    word = _WORDS[option.kind]
    if option.kind == "list":
        word = {"str": "texts", "int": "whole numbers", "float": "numbers"}[option.item]
        if option.count is not None:
            word = "%d %s" % (option.count, word)
    return " ".join([word, *describe_bounds(option)])


def describe_bounds(option):
    """Limits as text."""
    found = ["%s %s" % (sign, format_number(option.bounds[bound]))
             for bound, sign in _SIGNS if bound in option.bounds]
    found += ["%s (%s)" % (sign, " and ".join(option.sources[bound]) or "the config")
              for bound, sign in _SIGNS if bound in getattr(option, "sources", ())]
    return [", ".join(found)] if found else []


def format_number(value):
    """A limit in few digits."""
    return "%.7g" % (value,)


def describe_default(option):
    """The default as text."""
    if "default" in option.sources:
        names = option.sources["default"]
        return "(from %s)" % (", ".join(names) or "the config",)
    value = option.default
    if value is None or value == () or (isinstance(value, str) and not value.strip()):
        return ""
    if isinstance(value, bool):
        return "`yes`" if value else "`no`"
    if isinstance(value, float):
        return "" if abs(value) >= 99999999. else "`%s`" % (format_number(value),)
    if isinstance(value, (tuple, list)):
        value = ", ".join(str(part) for part in value)
    text = " ".join(str(value).split())
    return "`%s`" % (escape(text),)


def describe_condition(option):
    """When an option is read, as a sentence."""
    if option.is_always or option.is_of_sensor or not option.when:
        return ""
    (name, states), = option.when.items()
    if name == KINEMATICS or name == "kinematics":
        return "Kinematics: %s." % (", ".join(states),)
    if states == ["set"]:
        return "Only with `%s`." % (name,)
    if states == ["unset"]:
        return "Only without `%s`." % (name,)
    return "Only with `%s` %s." % (name, " or ".join("`%s`" % (state,)
                                                     for state in states))


def escape(text):
    """Text that does not end the cell of a table."""
    return text.replace("|", "\\|")


# Commands

GCODE_HEAD = """\
All G-code commands and their parameters. Commands of a letter and a number take letters
with numbers, `G1 X10 F3000`; all others `NAME=value`. **Bold** ones must be given.
A value in parentheses is a default in words.

A command is there if the section it belongs to is in the config; macros are commands
too. `HELP` lists those of your printer."""


def write_commands(commands, texts):
    """Text of gcode_reference.md."""
    chapters = {}
    for name, command in commands.items():
        chapters.setdefault(find_chapter(command.module), []).append(name)
    lines = [GENERATED, "# G-code reference", "", GCODE_HEAD]
    for title, _ in CHAPTERS:
        if title in chapters:
            lines += ["", "## " + title]
            for name in sorted(chapters[title], key=sort_key):
                lines += list_command(commands[name], texts.get(name, {}))
    return "\n".join(lines) + "\n"


def sort_key(name):
    """G-codes in order of number, then M-codes, then names."""
    digits = name[1:].partition(".")[0]
    return (name[:1], int(digits), name) if digits.isdigit() else ("~", 0, name)


def list_command(command, texts):
    """Lines about a command."""
    about = texts.get("about") or command.help
    lines = ["", "### " + command.name,
             about if about.endswith(".") else about + "."]
    rows = []
    if command.selector is not None:
        rows.append(write_row(command.selector, command.needs_selector, "text", "",
                              texts.get(command.selector)))
    for parameter in sorted(command.parameters.values(),
                            key=lambda parameter: not parameter.needed):
        if parameter.name != command.selector:
            rows.append(write_row(
                parameter.name, parameter.needed, describe_parameter(parameter),
                describe_parameter_default(parameter), texts.get(parameter.name)))
    for name, more in texts.items():
        if isinstance(more, dict):
            rows.append(write_row(name, False, _WORDS[more["kind"]], "", more["text"]))
    if FREE in texts:
        rows.append("| ... | text |  | %s |" % (escape(texts[FREE]),))
    if rows:
        lines += [*PARAMETER_HEAD, *rows]
    return lines


def write_row(name, is_needed, value, default, text):
    """Row of a table about a parameter."""
    mark = ("**`%s`**" if is_needed else "`%s`") % (name,)
    return "| %s | %s | %s | %s |" % (mark, value, default, escape(text or ""))


def describe_parameter(parameter):
    """Type and range of a parameter."""
    return " ".join([_WORDS[parameter.kind], *describe_bounds(parameter)])


def describe_parameter_default(parameter):
    """The default of a parameter as text."""
    if parameter.default is LIVE:
        return "(depends)"
    value = parameter.default
    if value is None or value == "" or value in (float("inf"), -float("inf")):
        return ""
    if isinstance(value, (int, float)):
        return "" if abs(value) >= 999999. else "`%s`" % (format_number(value),)
    return "`%s`" % (escape(str(value)),)
