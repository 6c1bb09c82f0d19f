# SPDX-License-Identifier: GPL-3.0-or-later
"""Macros on a whole printer: live reads, and a reload in the middle of a print."""

from machine_configs import BED, make_axes
from printer_run import PrinterRun

MACROS = """
[respond]

[gcode_macro SOAK]
live: True
gcode:
    M140 S60
    {% for minute in range(20) if printer.heater_bed.temperature < 58 %}
        G4 P10000
        M400
    {% endfor %}
    G28
    G1 X7 F6000
    RESPOND MSG="{printer.toolhead.homed_axes} {printer.toolhead.position.x}"
    RESPOND MSG="warm: {printer.heater_bed.temperature >= 58}"

[gcode_macro TELL]
gcode:
    RESPOND MSG="before"
"""


def test_live_macro_and_reload_while_the_printer_works(tmp_path):
    config = make_axes("cartesian", extra=BED) + MACROS

    def change(printer):
        gcode = printer.lookup_object("gcode")
        gcode.run_script("TELL")
        text = (tmp_path / "printer.cfg").read_text()
        (tmp_path / "printer.cfg").write_text(text.replace('"before"', '"after"'))
        gcode.run_script("G1 X10 Y10 F3000\nRELOAD_GCODE_MACROS\nG1 X20\nTELL")

    run = PrinterRun(config, tmp_path).run(["SOAK", change])
    told = [text for text in run.responses if text.startswith("echo:")]
    assert told == ["echo: xyz 7.0", "echo: warm: True", "echo: before", "echo: after"]
    assert "// Macros: 1 changed, 0 new, 0 removed, 1 as before" in run.responses
    assert run.snapshots[-1].position[:2] == [20., 10.]
