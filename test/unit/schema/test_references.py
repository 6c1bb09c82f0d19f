# SPDX-License-Identifier: GPL-3.0-or-later
"""The config and G-code references: complete, with a line about everything, not stale.

test/data/gcode_facts.json lists parameters with type, default and range by command.
"""
import argparse
import ast
import json
import logging
import pathlib

import pytest

from klippy.cli import schema as command
from klippy.schema import markdown
from klippy.schema.commands import read_commands
from klippy.schema.parameters import LIVE, Reader
from klippy.schema.texts import FREE, read_command_texts, read_texts

ROOT = pathlib.Path(__file__).resolve().parents[3]
FACTS = json.loads((ROOT / "test/data/gcode_facts.json").read_text())
COMPUTED = {"computed": True}
# Placeholders of the facts: words without name
PLACEHOLDERS = ("<", "*")
# Where this host differs from the facts for a reason: parameter, and what
OTHERWISE = {
    # 255 is full speed, also without S
    ("M106", "S", "default"),
    # words of a move are taken apart elsewhere
    ("G0", "type"), ("G1", "type"),
    # a state with a move needs a speed, and a carriage its name
    ("RESTORE_DUAL_CARRIAGE_STATE", "MOVE_SPEED", "default"),
    ("SET_DUAL_CARRIAGE", "CARRIAGE", "required"),
}


@pytest.fixture(scope="module")
def commands(catalog):
    return read_commands(catalog.rooms)


@pytest.fixture(scope="module")
def texts():
    return read_command_texts()


def read_docs(name):
    return (ROOT / "docs" / name).read_text()


def test_docs_are_what_modules_say(catalog, commands, texts):
    assert read_docs("config_reference.md") == markdown.write_config(
        catalog.sections, read_texts()), "run `make docs`"
    assert read_docs("gcode_reference.md") == markdown.write_commands(
        commands, texts), "run `make docs`"


def test_command_writes_them(catalog, commands, monkeypatch, tmp_path):
    monkeypatch.setattr(command, "read_catalog", lambda folders: catalog)
    monkeypatch.setattr(command, "read_commands", lambda rooms: commands)
    monkeypatch.setattr(logging, "disable", lambda level: None)
    assert command.run(argparse.Namespace(
        plugins=[], convert=None, markdown=str(tmp_path))) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "config_reference.md", "gcode_reference.md"]


def list_parameters():
    for name, parameters in FACTS.items():
        for parameter, fact in parameters.items():
            if not parameter.startswith(PLACEHOLDERS) and "<" not in parameter:
                yield name, parameter, fact


def find_parameter(commands, name, parameter):
    return commands[name].parameters.get(parameter)


def test_commands_of_the_facts(commands):
    assert set(FACTS) <= set(commands) and len(FACTS) > 100


def test_parameters_of_the_facts(commands, texts):
    missing = [(name, parameter) for name, parameter, _ in list_parameters()
               if parameter not in commands[name].parameters
               and parameter != commands[name].selector
               and not isinstance(texts[name].get(parameter), dict)]
    assert not missing


def list_variants(fact):
    return [fact, *fact.get("variants", ())]


def test_types(commands):
    wrong = []
    for name, parameter, fact in list_parameters():
        found = find_parameter(commands, name, parameter)
        wanted = {variant["type"] for variant in list_variants(fact)}
        is_plain = wanted <= {"int", "float", "str"}
        if found is None or (name, "type") in OTHERWISE:
            continue
        if is_plain and found.kind not in wanted:
            wrong.append((name, parameter, found.kind, wanted))
    assert not wrong, "\n".join(map(str, wrong))


def test_defaults(commands):
    wrong = []
    for name, parameter, fact in list_parameters():
        found = find_parameter(commands, name, parameter)
        wanted = [variant.get("default") for variant in list_variants(fact)]
        wanted = [float(one) if one in ("inf", "-inf") else one for one in wanted]
        if found is None or found.default is LIVE or COMPUTED in wanted or (
                name, parameter, "default") in OTHERWISE:
            continue
        if not set(wanted) & {found.default, None}:
            wrong.append((name, parameter, found.default, wanted))
    assert not wrong, "\n".join(map(str, wrong))


def test_what_must_be_given(commands):
    wrong = []
    for name, parameter, fact in list_parameters():
        found = find_parameter(commands, name, parameter)
        may_miss = any(not variant["required"] for variant in list_variants(fact))
        if found is not None and found.needed and may_miss and (
                name, parameter, "required") not in OTHERWISE:
            wrong.append((name, parameter))
    assert not wrong


def test_ranges(commands):
    wrong = []
    for name, parameter, fact in list_parameters():
        found = find_parameter(commands, name, parameter)
        for bound in ("minval", "maxval", "above", "below"):
            wanted = [variant.get(bound) for variant in list_variants(fact)]
            if found is None or None in wanted or COMPUTED in wanted:
                continue
            if found.bounds.get(bound) not in wanted:
                wrong.append((name, parameter, bound, found.bounds, wanted))
    assert not wrong, "\n".join(map(str, wrong))


def test_every_command_and_parameter_has_a_line(commands, texts):
    missing = []
    for name, found in commands.items():
        own = texts.get(name)
        if own is None or not (own.get("about") or found.help):
            missing.append(name)
            continue
        names = set(found.parameters) | ({found.selector} - {None})
        missing += [(name, parameter) for parameter in names if parameter not in own]
        if found.takes_text and FREE not in own:
            missing.append((name, FREE))
    assert not missing


def test_no_line_is_about_nothing(commands, texts):
    assert set(texts) <= set(commands)
    for name, own in texts.items():
        known = {*commands[name].parameters, commands[name].selector, "about", FREE}
        assert {key for key, text in own.items() if isinstance(text, str)} <= known


def list_registered():
    """Names in calls like gcode.register_command("G4", ...) of the sources."""
    for path in (ROOT / "klippy").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
                    and node.func.attr in ("register_command", "register_mux_command")
                    and isinstance(node.args[0], ast.Constant)):
                yield node.args[0].value


def test_no_command_of_the_sources_is_missed(commands):
    registered = set(list_registered())
    assert len(registered) > 50
    assert registered <= set(commands)


# Handlers

class Handlers:
    """Handlers as the modules have them."""

    axes = "xy"
    speed = 5.

    def cmd_plain(self, gcmd):
        gcmd.get_float("SPEED", 2. * 3., above=0., maxval=10)
        gcmd.get_int("COUNT", minval=1)
        gcmd.get("NAME", None)

    def cmd_loop(self, gcmd):
        for axis in self.axes:
            gcmd.get_float("OFFSET_" + axis.upper(), self.speed)

    def cmd_inner(self, gcmd):
        self._read(gcmd, "A")
        self._read(gcmd, "B")

    def _read(self, gcmd, letter):
        name = letter * 2
        return gcmd.get(name, "?")

    def cmd_looks(self, gcmd):
        params = gcmd.get_command_parameters()
        if "F" in params:
            gcmd.get_float("F")


@pytest.fixture
def read(monkeypatch):
    monkeypatch.setattr("klippy.schema.sources.is_ours", lambda module: True)
    return lambda name: {
        key: (found.kind, found.needed, found.default, found.bounds)
        for key, found in Reader().read(getattr(Handlers(), name)).found.items()}


def test_types_and_ranges_are_read(read):
    assert read("cmd_plain") == {
        "SPEED": ("float", False, 6., {"above": 0., "maxval": 10}),
        "COUNT": ("int", True, None, {"minval": 1}), "NAME": ("str", False, None, {})}


def test_loops_and_calls_are_followed(read):
    assert read("cmd_loop") == {"OFFSET_X": ("float", False, LIVE, {}),
                                "OFFSET_Y": ("float", False, LIVE, {})}
    assert read("cmd_inner") == {"AA": ("str", False, "?", {}),
                                 "BB": ("str", False, "?", {})}


def test_what_is_looked_for_first_may_miss(read):
    assert read("cmd_looks") == {"F": ("float", False, None, {})}


# Text

def test_rows_of_options(catalog):
    texts = read_texts()
    fan = catalog.sections["fan"].options
    assert markdown.write_option(fan["max_power"], texts.get_option(
        "fan", fan["max_power"])) == (
            "| `max_power` | number > 0, ≤ 1 | `1` | Share of full power (0 to 1) at"
            " full speed. |")
    assert markdown.write_option(fan["tachometer_ppr"], "A | b.") == (
        "| `tachometer_ppr` | whole number ≥ 1 | `2` | A \\| b. Only with"
        " `tachometer_pin`. |")
    assert markdown.write_option(fan["pin"], "") == "| **`pin`** | text |  |  |"


def test_every_table_is_whole():
    for name in ("config_reference.md", "gcode_reference.md"):
        for line in (ROOT / "docs" / name).read_text().splitlines():
            if line.startswith("|"):
                assert line.replace("\\|", "").count("|") == 5, line
                assert line == "|---|---|---|---|" or line.split("|")[4].strip(), line
