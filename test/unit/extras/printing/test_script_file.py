# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts that the config includes from files of their own."""
import pytest
from front_end import Printer

from klippy import configfile
from klippy.errors import ConfigError
from klippy.extras.gcode_macro import GCodeMacro


def run_macro(folder, value):
    """What a macro says whose option gcode is value."""
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "printer.cfg").write_text("[include parts/m.cfg]\n")
    (folder / "parts/m.cfg").write_text("[gcode_macro M]\ngcode: %s\n" % (value,))
    printer = Printer(config_file=str(folder / "printer.cfg"))
    config = configfile.PrinterConfig(printer)
    printer.add_object("configfile", config)
    try:
        GCodeMacro(config.read_main_config().getsection("gcode_macro M"))
        printer.make_ready()
        printer.gcode.run_script("M X=3")
        return printer.output[:]
    finally:
        printer.close()


def test_file_beside_the_one_that_names_it(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/park.gcode").write_text(
        "ECHO begin\n{% if params.X %}\nECHO {params.X}\n{% endif %}\n")
    assert run_macro(tmp_path, "!!include park.gcode") == [
        "// ECHO begin", "// ECHO 3"]
    assert run_macro(tmp_path, "\n  !!include %s/parts/park.gcode" % (tmp_path,)) == [
        "// ECHO begin", "// ECHO 3"]


@pytest.mark.parametrize("value, text", [
    ("!!include none.gcode", "unable to read '.*none.gcode': No such file"),
    ("!!include m.py", "is in Python"), ("!!include", "is no G-code"),
    ("\n  !emit('G28')\n  !emit('G1')", "lines of Python .* are not known")])
def test_what_cannot_be_read(tmp_path, value, text):
    with pytest.raises(ConfigError, match=text) as info:
        run_macro(tmp_path, value)
    assert info.value.place.path.endswith("m.cfg") and info.value.place.line == 2
