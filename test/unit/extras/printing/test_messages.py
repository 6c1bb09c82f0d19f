# SPDX-License-Identifier: GPL-3.0-or-later
"""respond, display_status, delayed_gcode, save_variables, statistics."""

import pytest
from front_end import Printer, make_printer

from klippy.errors import CommandError, ConfigError
from klippy.extras import save_variables, statistics


@pytest.mark.parametrize("options, script, output", [
    ({}, "M118 Hello (you)", "echo: Hello (you)"),
    ({}, "M118", "echo: "),
    ({"default_type": "command"}, "M118 a", "// a"),
    ({"default_prefix": "<>"}, "RESPOND MSG='a b'", "<> a b"),
    ({}, "RESPOND TYPE=error MSG=a", "!! a"),
    ({}, "RESPOND TYPE=ECHO_NO_SPACE MSG=a", "echo:a"),
    ({}, "RESPOND PREFIX=x: MSG=a", "x: a"),
])
def test_respond(options, script, output):
    printer = make_printer(("respond", options))
    printer.gcode.run_script(script)
    assert printer.output == [output]
    with pytest.raises(CommandError, match="TYPE 'x' is unknown"):
        printer.gcode.run_script("RESPOND TYPE=x")
    printer.close()


class Sdcard:
    def get_status(self, eventtime):
        return {"progress": 0.25}


def test_display_status():
    printer = make_printer("display_status")
    display = printer.lookup_object("display_status")

    def status():
        return display.get_status(printer.clock.now)
    assert status() == {"progress": 0., "message": None}
    printer.add_object("virtual_sdcard", Sdcard())
    printer.gcode.run_script("M117 Layer 5 (top) ; x\nM73 P50 R3")
    assert status() == {"progress": .5, "message": "Layer 5 (top)"}
    printer.gcode.run_script("M73 P150\nM73\nM117")
    assert status() == {"progress": 1., "message": None}
    printer.run_for(10.)
    assert status()["progress"] == 0.25
    printer.gcode.run_script("SET_DISPLAY_TEXT MSG='x y'")
    assert status()["message"] == "x y"
    printer.gcode.run_script("SET_DISPLAY_TEXT")
    assert status()["message"] is None
    printer.close()


def test_delayed_gcode():
    printer = make_printer(
        ("delayed_gcode a", {"gcode": "ECHO a", "initial_duration": "5"}),
        ("delayed_gcode b", {"gcode": "ECHO b\nUPDATE_DELAYED_GCODE ID=b DURATION=2"}),
        ("delayed_gcode c", {"gcode": "\1", "initial_duration": "1"}))
    printer.run_for(4.)
    assert printer.output == [r"!! '\x01' is no G-code command"]
    printer.output.clear()
    printer.run_for(6.)
    assert printer.output == ["// ECHO a"]
    printer.gcode.run_script("UPDATE_DELAYED_GCODE ID=b DURATION=1")
    printer.run_for(6.)
    assert printer.output.count("// ECHO b") == 3
    printer.gcode.run_script("UPDATE_DELAYED_GCODE ID=b DURATION=0")
    printer.run_for(6.)
    assert printer.output.count("// ECHO b") == 3
    with pytest.raises(CommandError, match="at least 0"):
        printer.gcode.run_script("UPDATE_DELAYED_GCODE ID=b DURATION=-1")
    printer.close()


def test_save_variables(tmp_path):
    path = tmp_path / "vars.cfg"
    options = ("save_variables", {"filename": str(path)})
    printer = make_printer(options)
    assert path.exists()
    printer.gcode.run_script("SAVE_VARIABLE VARIABLE=a VALUE=1.5\n"
                             "SAVE_VARIABLE VARIABLE=b VALUE='[\"x%y\", None]'")
    for text, message in (("VARIABLE=A VALUE=1", "no name for a variable"),
                          ("VARIABLE=a=b VALUE=1", "no name for a variable"),
                          ("VARIABLE=c VALUE=x", "'x' is no number")):
        with pytest.raises(CommandError, match=message):
            printer.gcode.run_script("SAVE_VARIABLE " + text)
    printer.close()
    printer = make_printer(options)
    assert printer.lookup_object("save_variables").get_status(0.) == {
        "variables": {"a": 1.5, "b": ["x%y", None]}}
    printer.close()


def test_save_variables_keeps_the_old_file_when_it_cannot_write(tmp_path, monkeypatch):
    path = tmp_path / "vars.cfg"
    printer = make_printer(("save_variables", {"filename": str(path)}))
    printer.gcode.run_script("SAVE_VARIABLE VARIABLE=a VALUE=1")

    def fail(descriptor):
        raise OSError(28, "No space left on device")
    monkeypatch.setattr(save_variables.os, "fsync", fail)
    with pytest.raises(CommandError, match="No space left"):
        printer.gcode.run_script("SAVE_VARIABLE VARIABLE=a VALUE=2")
    assert save_variables.read_variables(str(path)) == {"a": 1}
    printer.close()


@pytest.mark.parametrize("text", ["garbage\n", "[Variables]\na = x y\n"])
def test_save_variables_with_a_broken_file(tmp_path, text):
    path = tmp_path / "vars.cfg"
    path.write_text(text)
    with pytest.raises(ConfigError, match="filename '.*vars.cfg'"):
        make_printer(("save_variables", {"filename": str(path)}))
    assert path.read_text() == text


class Source:
    def __init__(self, is_active, text):
        self.answer = is_active, text

    def stats(self, eventtime):
        return self.answer


def test_statistics(caplog, monkeypatch, tmp_path):
    caplog.set_level("INFO")
    printer = Printer()
    printer.add_object("a", Source(True, "x=1"))
    printer.add_object("b", Source(False, ""))
    printer.load("statistics")
    printer.make_ready()
    printer.run_for(3.)
    lines = [r.getMessage() for r in caplog.records if "Stats" in r.getMessage()]
    assert 2 <= len(lines) <= 3
    assert lines[0].startswith("Stats 10") and "x=1 sysload=" in lines[0]
    status = printer.lookup_object("system_stats").get_status(0.)
    assert status["cputime"] > 0. and status["memavail"] > 0
    printer.lookup_object("a").answer = (False, "x=1")
    assert printer.lookup_object("statistics").collect(5.) is None
    printer.close()
    monkeypatch.setattr(statistics, "MEMORY_FILE", str(tmp_path / "none"))
    assert statistics.read_available_memory() == 0
