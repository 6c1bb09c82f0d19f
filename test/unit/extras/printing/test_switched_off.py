# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that switch a section off, describe a command, or open subfolders."""
import pytest
from front_end import make_printer, write_file


@pytest.mark.parametrize("section, option, commands", [
    ("respond", "enable_respond", ("M118", "RESPOND")),
    ("exclude_object", "enable_exclude_object",
     ("EXCLUDE_OBJECT", "EXCLUDE_OBJECT_START", "EXCLUDE_OBJECT_DEFINE"))])
@pytest.mark.parametrize("value", ["True", "False"])
def test_sections_switched_off(section, option, commands, value):
    printer = make_printer((section, {option: value}), motion=True)
    known = printer.gcode.get_status(0.)["commands"]
    assert {name in known for name in commands} == {value == "True"}
    assert section in printer.objects
    printer.close()


def test_description_of_delayed_gcode():
    printer = make_printer(
        ("delayed_gcode one", {"gcode": "ECHO", "description": "Go"}))
    assert printer.gcode.get_command_help()["UPDATE_DELAYED_GCODE"] == "Go"
    printer.close()


@pytest.mark.parametrize("value", ["True", "False"])
def test_subfolders_of_the_card(tmp_path, value):
    write_file(tmp_path, "a.gcode", "M110\n")
    write_file(tmp_path, "sub/b.gcode", "M110\n")
    printer = make_printer(("virtual_sdcard", {
        "path": str(tmp_path), "with_subdirs": value}), motion=True)
    printer.gcode.run_script("M20")
    assert ("sub/b.gcode 5" in printer.output) == (value == "True")
    assert "a.gcode 5" in printer.output
    if value == "True":
        printer.gcode.run_script("M23 sub/b.gcode")
        assert "File opened:sub/b.gcode Size:5" in printer.output
    else:
        with pytest.raises(printer.command_error, match="no file"):
            printer.gcode.run_script("M23 sub/b.gcode")
    printer.close()
