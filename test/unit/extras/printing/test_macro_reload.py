# SPDX-License-Identifier: GPL-3.0-or-later
import pytest
from front_end import Printer

from klippy import configfile, webhooks
from klippy.errors import CommandError
from klippy.extras.gcode_macro import GCodeMacro

START = """
[gcode_macro GREET]
variable_name: "you"
variable_count: 0
description: says hello
gcode:
    ECHO hello {name} {count}

[gcode_macro OLD]
gcode:
    ECHO old

[gcode_macro M117]
rename_existing: M117.1
gcode:
    M117.1 {rawparams}
"""


COUNTS = "// Macros: %d changed, %d new, %d removed, %d as before"


class Macros:
    """A printer whose macros come from a real config file."""

    def __init__(self, path):
        self.path = path
        path.write_text(START)
        self.printer = printer = Printer(config_file=str(path))
        webhooks.setup(printer)
        self.config = configfile.PrinterConfig(printer)
        printer.add_object("configfile", self.config)
        printer.gcode.register_command(
            "M117", lambda gcmd: gcmd.respond_info("shown"), desc="Show a text")
        main = self.config.read_main_config()
        for section in main.get_prefix_sections("gcode_macro "):
            printer.objects[section.get_name()] = GCodeMacro(section)
        printer.make_ready()

    def run(self, script):
        self.printer.output.clear()
        self.printer.gcode.run_script(script)
        return self.printer.output[:]

    def reload(self, text):
        self.path.write_text(text)
        return self.run("RELOAD_GCODE_MACROS")

    def commands(self):
        return self.printer.gcode.get_status(0.)["commands"]


@pytest.fixture
def macros(tmp_path):
    made = Macros(tmp_path / "printer.cfg")
    yield made
    made.printer.close()


def test_nothing_changed(macros):
    assert macros.reload(START) == [COUNTS % (0, 0, 0, 3)]
    assert macros.run("GREET") == ["// ECHO hello you 0"]
    assert macros.run("M117 A") == ["// shown"]


def test_text_changes_and_values_set_meanwhile_stay(macros):
    macros.run("SET_GCODE_VARIABLE MACRO=GREET VARIABLE=count VALUE=7\n"
               "SET_GCODE_VARIABLE MACRO=GREET VARIABLE=name VALUE='\"me\"'")
    text = START.replace("hello", "goodbye").replace('"you"', '"all"')
    text = text.replace("variable_count: 0\n", "variable_count: 0\nvariable_new: 1\n")
    assert macros.reload(text)[0].startswith("// Macros: 1 changed, 0 new")
    # the author changed the name, so it is the author's
    assert macros.run("GREET") == ["// ECHO goodbye all 7"]
    status = macros.printer.lookup_object("gcode_macro GREET").get_status(0.)
    assert status == {"name": "all", "count": 7, "new": 1}
    assert macros.commands()["GREET"] == {"help": "says goodbye"}
    shown = macros.config.get_status(0.)
    assert "goodbye" in shown["config"]["gcode_macro GREET"]["gcode"]
    assert shown["settings"]["gcode_macro greet"]["variable_new"] == "1"


def test_macros_come_and_go(macros):
    text = START.replace("[gcode_macro OLD]", "[gcode_macro New]")
    assert macros.reload(text) == [COUNTS % (0, 1, 1, 2)]
    assert macros.run("NEW") == ["// ECHO old"]
    assert "OLD" not in macros.commands() and "NEW" in macros.commands()
    assert macros.run("OLD") == ['// Unknown command:"OLD"']
    assert macros.printer.lookup_object("gcode_macro OLD", None) is None
    assert macros.reload(START) == [COUNTS % (0, 1, 1, 2)]
    assert macros.run("OLD") == ["// ECHO old"]


def test_name_in_another_case_is_another_section(macros):
    macros.reload(START.replace("[gcode_macro OLD]", "[gcode_macro old]"))
    assert macros.run("OLD") == ["// ECHO old"]
    macros.run("RELOAD_GCODE_MACROS")


def test_renamed_command_comes_and_goes(macros):
    without = START[:START.index("[gcode_macro M117]")]
    macros.reload(without)
    assert macros.run("M117 A") == ["// shown"]
    assert "M117.1" not in macros.commands()
    macros.reload(START)
    assert macros.run("M117 A") == ["// shown"] and "M117.1" in macros.commands()


@pytest.mark.parametrize("change, error", [
    (("ECHO old", "ECHO {% if %}"), r"printer.cfg:9: Error in the template of"),
    (("[gcode_macro OLD]\n", "[gcode_macro OLD]\ndescripton: x\n"),
     r"printer.cfg:10: option 'descripton' in section \[gcode_macro OLD\]: there is no"
     r" such option; did you mean 'description'\?"),
    (("variable_count: 0", "variable_count: zero"), "'zero' is no number"),
    (("[gcode_macro OLD]", "[gcode_macro ECHO]"), "there is a command ECHO already"),
    (("M117.1\ngcode", "M117.2\ngcode"), "a change of it needs a RESTART"),
    (("[gcode_macro OLD]\n", "[gcode_macro FOO]\nrename_existing: BAR\n"),
     "there is no command 'FOO' to rename"),
    (("[gcode_macro OLD]\n", "[gcode_macro ECHO]\nrename_existing: HELP\n"),
     "there is a command 'HELP' already"),
    (("[gcode_macro OLD]", "[gcode_macro OLD"), "printer.cfg:9: .*header"),
    (("gcode:\n    ECHO old", "description: x"), "'gcode' in section .* must be set"),
])
def test_error_leaves_all_as_it_was(macros, change, error):
    text = START.replace("hello", "goodbye").replace(*change)
    assert text != START.replace("hello", "goodbye")
    with pytest.raises(CommandError, match="(?s)stay as they were.*" + error):
        macros.reload(text)
    assert macros.run("GREET") == ["// ECHO hello you 0"]
    assert macros.run("OLD") == ["// ECHO old"] and macros.run("M117") == ["// shown"]


def test_all_errors_are_told_at_once(macros):
    text = START.replace("ECHO old", "{% if %}").replace("count: 0", "count: x")
    with pytest.raises(CommandError) as caught:
        macros.reload(text)
    assert "OLD" in str(caught.value) and "variable_count" in str(caught.value)


def test_macro_that_runs_ends_as_it_began(macros):
    text = START.replace(
        "ECHO old", "ECHO a {rawparams}\n  RELOAD_GCODE_MACROS\n  ECHO b")
    macros.reload(text)
    macros.path.write_text(text.replace("ECHO b", "ECHO c"))
    assert macros.run("OLD A=1")[0::2] == ["// ECHO a A=1", "// ECHO b"]
    assert macros.run("OLD A=1")[-1] == "// ECHO c"
