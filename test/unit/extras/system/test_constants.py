# SPDX-License-Identifier: GPL-3.0-or-later
"""[constants] in a whole printer: values reach the modules, idle ones are told."""
from outputs_bench import OutputsBench

CONFIG = """
[constants]
led: PA1
idle_one: 7
[output_pin a]
pin: ${constants.led}
[gcode_macro m]
variable_pin: '${output_pin a.pin}'
gcode: M118 ${params.X}
"""


def test_constants_reach_the_printer(tmp_path, monkeypatch):
    def body(it):
        status = it.printer.lookup_object("configfile").get_status(0.)
        assert status["config"]["output_pin a"]["pin"] == "PA1"
        assert status["settings"]["constants"] == {"led": "PA1", "idle_one": "7"}
        assert it.printer.lookup_object("gcode_macro m").variables == {"pin": "PA1"}
        assert [entry["message"] for entry in status["warnings"]] == [
            "Constant 'idle_one' is unused"]
    OutputsBench(tmp_path, monkeypatch, CONFIG).run_ready(body)
