# SPDX-License-Identifier: GPL-3.0-or-later
import pytest
from front_end import Printer, make_printer
from hypothesis import given
from hypothesis import strategies as st

from klippy import webhooks
from klippy.errors import CommandError, ConfigError
from klippy.extras import gcode_macro


class Thing:
    """Counts how often its status is read."""
    reads = 0

    def get_status(self, eventtime):
        self.reads += 1
        return {"t": 21.5, "list": [1], "nested": {"a": (1, 2)}}


def make_macro(text, name="TEST", **options):
    printer = Printer()
    printer.add_object("thing", Thing())
    printer.add_object("fan part", Thing())
    webhooks.setup(printer)
    printer.load("gcode_macro " + name, gcode=text, **options)
    printer.make_ready()
    return printer


def run(text, command="TEST", **options):
    """Output of a macro."""
    printer = make_macro(text, **options)
    try:
        printer.gcode.run_script(command)
    finally:
        printer.close()
    return [line for line in printer.output if "Disconnect" not in line]


def test_template_language():
    text = """
      {% set n = params.N|default(2)|int %}
      {% for i in range(n) %}
        ECHO {i} {printer.thing.t} {printer["fan part"].nested.a[1]} {rawparams}
      {% endfor %}
      {# a comment #}
      {% if 'nope' in printer or printer.nope is defined %} ECHO wrong {% endif %}
      {% if 'thing' in printer %} ECHO {"%.1f" % (n / 4.0)} {v.k} {% endif %}
      {% do printer.thing.list.append(5) %}
    """
    assert run(text, "test n=2", variable_v="{'k': 'x'}") == [
        "// ECHO 0 21.5 2 n=2", "// ECHO 1 21.5 2 n=2", "// ECHO 0.5 x"]


def test_mathematics_unless_a_variable_has_its_name():
    assert run("ECHO {math.floor(math.pi)}") == ["// ECHO 3"]
    assert run("ECHO {math}", variable_math="5") == ["// ECHO 5"]


class Counter:
    """Status of a number that a command counts up."""
    value = 0

    def count(self, gcmd):
        self.value += gcmd.get_int("BY", 1)

    def get_status(self, eventtime):
        return {"value": self.value}


def run_counting(text, **options):
    printer = make_macro(text, **options)
    counter = Counter()
    printer.add_object("counter", counter)
    printer.gcode.register_command("COUNT", counter.count)
    try:
        printer.gcode.run_script("TEST N=3")
    finally:
        printer.close()
    return [line for line in printer.output if "Disconnect" not in line]


COUNTING = """
  {% for i in range(params.N|int) %}
    COUNT
    ECHO {printer.counter.value}
  {% endfor %}
  {% if printer.counter.value == 3 %} ECHO three {% endif %}
"""


def test_live_macro_sees_what_its_lines_did():
    assert run_counting(COUNTING) == ["// ECHO 0"] * 3
    assert run_counting(COUNTING, live="True") == [
        "// ECHO 1", "// ECHO 2", "// ECHO 3", "// ECHO three"]


def test_live_macro_runs_whole_lines_only():
    text = "COUNT BY={2}{3}\nECHO {printer.counter.value} {% if 1 %}x{% endif %}"
    assert run_counting(text, live="True") == ["// ECHO 23 x"]


def test_error_in_a_live_macro_comes_after_the_lines_before_it():
    with pytest.raises(CommandError, match="line 3: ZeroDivisionError"):
        run_counting("COUNT\nECHO {printer.counter.value}\nECHO {1/0}\nCOUNT",
                     live="True")


def test_status_is_read_once_an_evaluation():
    printer = make_macro("{% for i in range(9) %}{% set x = printer.thing.t %}"
                         "{% endfor %}")
    printer.gcode.run_script("TEST\nTEST")
    assert printer.lookup_object("thing").reads == 2
    printer.close()


def test_actions(caplog):
    printer = make_macro("{action_respond_info('hi')}"
                         "{action_call_remote_method('beep', x=1)}"
                         "{action_raise_error('stop')}")
    with pytest.raises(CommandError, match="^stop$"):
        printer.gcode.run_script("TEST")
    assert printer.output == ["// hi", "!! stop"]
    assert "'beep' is not registered" in caplog.text
    printer.close()
    printer = make_macro("{action_emergency_stop('me')}")
    printer.gcode.run_script("TEST")
    assert printer.message == "Shutdown due to me"
    printer.close()


@pytest.mark.parametrize("text, message", [
    ("{1 / 0}", r"\[gcode_macro TEST\] option 'gcode', line 1: ZeroDivisionError"),
    ("\n\n{printer.nope.x}", "line 3: UndefinedError"),
    ("{'a' + 1}", "TypeError"), ("{[1].x()}", "UndefinedError"),
    ("{params.X|float * [1]}", "line 1"),
])
def test_errors_of_expressions(text, message):
    with pytest.raises(CommandError, match=message):
        run(text)


def test_plain_text_needs_no_jinja():
    assert run("\n  ECHO 1 }\n  ECHO 2\n\n") == ["// ECHO 1 }", "// ECHO 2"]
    printer = make_macro("ECHO 1")
    assert printer.lookup_object("gcode_macro").env is None
    printer.close()


def test_a_template_known_to_be_right_is_compiled_when_it_runs():
    text = "ECHO {printer.thing.t} {# known #}"
    assert run(text) == ["// ECHO 21.5"]
    printer = make_macro(text)
    assert printer.lookup_object("gcode_macro").env is None
    printer.gcode.run_script("TEST")
    assert printer.lookup_object("gcode_macro").env is not None
    assert "// ECHO 21.5" in printer.output
    printer.close()


def test_syntax_error_names_section_and_line():
    with pytest.raises(ConfigError, match=(
            r"template of \[gcode_macro TEST\] option 'gcode', line 2: "
            r".*'\{% fi %\}'")):
        make_macro("G28\n{% fi %}")


def test_variables():
    printer = make_macro("ECHO {a} {b.c}", variable_a="1.5", variable_b="{'c': None}")
    status = printer.lookup_object("gcode_macro TEST").get_status(0.)
    assert status == {"a": 1.5, "b": {"c": None}}
    printer.gcode.run_script(
        "TEST\nSET_GCODE_VARIABLE MACRO=TEST VARIABLE=a VALUE='\"x y\"'\nTEST")
    assert printer.output == ["// ECHO 1.5 None", "// ECHO x y None"]
    assert status["a"] == 1.5
    for text, message in (("VARIABLE=z VALUE=1", "no variable 'z': known are a, b"),
                          ("VARIABLE=a VALUE=x", "'x' is no number"),
                          ("VARIABLE=a VALUE=1e400", "JSON cannot"),
                          ("VARIABLE=a VALUE={1}", "JSON cannot")):
        with pytest.raises(CommandError, match=message):
            printer.gcode.run_script("SET_GCODE_VARIABLE MACRO=TEST " + text)
    printer.close()
    with pytest.raises(ConfigError, match="option 'variable_a': 'x' is no number"):
        make_macro("", variable_a="x")


def test_rename_existing():
    printer = Printer()
    seen = []
    printer.gcode.register_command("G28", lambda c: seen.append(
        c.get_command_parameters()))
    printer.load("gcode_macro G28", gcode="ECHO mine\nG28.1 {rawparams}",
                 rename_existing="G28.1")
    printer.make_ready()
    printer.gcode.run_script("G28 X Y")
    assert printer.output == ["// ECHO mine"] and seen == [{"X": "", "Y": ""}]
    printer.close()


@pytest.mark.parametrize("name, renamed, message", [
    ("G28", "OLD_G28", "must be a letter with a number"),
    ("PAUSE", "P1", "must not be a letter with a number"),
    ("NOPE", "OLD_NOPE", "no command 'NOPE' to rename")])
def test_wrong_rename(name, renamed, message):
    with pytest.raises(ConfigError, match=message):
        make_macro("", name=name, rename_existing=renamed)


def test_recursion_and_its_end():
    printer = make_macro("{% if params.DEEP %}TEST{% endif %}")
    for _ in range(2):
        with pytest.raises(CommandError, match="TEST called recursively"):
            printer.gcode.run_script("TEST DEEP=1")
    printer.gcode.run_script("TEST")
    assert printer.gcode.get_status(0.)["commands"]["TEST"] == {"help": "G-Code macro"}
    printer.close()


def test_name_with_blanks():
    with pytest.raises(ConfigError, match="without blanks"):
        make_printer(("gcode_macro A B", {"gcode": ""}))


@given(st.text(max_size=40))
def test_parse_literal_raises_nothing_else(text):
    try:
        gcode_macro.parse_literal(text)
    except ValueError as err:
        assert str(err)
