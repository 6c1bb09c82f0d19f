# SPDX-License-Identifier: GPL-3.0-or-later
import logging

import pytest
from front_end import make_printer
from hypothesis import given, settings
from hypothesis import strategies as st

from klippy import gcode
from klippy.errors import CommandError, ConfigError


class Sink(gcode.MoveSink):
    def __init__(self):
        self.moves = []

    def move_line(self, scan):
        if scan.x > 100.:
            raise CommandError("Move out of range")
        if scan.x < -100.:
            raise ZeroDivisionError("broken")
        self.moves.append((scan.mask, scan.x, scan.e))
        return 0


@pytest.fixture
def printer():
    made = make_printer(software_version="v1")
    yield made
    made.close()


@pytest.fixture
def calls(printer):
    """Commands that reached the handlers of FOO, G0, G1 and T0."""
    seen = []
    for name in ("FOO", "G0", "G1", "G28", "T0", "M117"):
        printer.gcode.register_command(name, seen.append)
    return seen


def lines(calls):
    return [(c.get_command(), c.get_command_parameters()) for c in calls]


def test_forms_of_a_line(printer, calls):
    printer.gcode.run_script(
        "g1x1 y2\n\n; note\n(note)\n%%\n  foo a=1 ; c\r\nT0\nG28XY\nG01 E1\nN5 G0 X2\n"
        "N6 M117 hi*%d" % gcode._checksum("N6 M117 hi"))
    assert lines(calls) == [
        ("G1", {"X": "1", "Y": "2"}), ("FOO", {"A": "1"}), ("T0", {}),
        ("G28", {"X": "", "Y": ""}), ("G1", {"E": "1"}), ("G0", {"X": "2"}),
        ("M117", {"H": "", "I": ""})]
    assert calls[-1].get_raw_command_parameters() == "hi"
    assert calls[1].get_commandline() == "foo a=1 ; c"


def test_wrong_checksum_is_an_error(printer, calls):
    with pytest.raises(CommandError, match="is 1, it must be"):
        printer.gcode.run_script("N6 FOO*1")
    printer.gcode.run_script("FOO A=2*3")
    assert lines(calls) == [("FOO", {"A": "2*3"})]


@pytest.mark.parametrize("line", ["\0\0G1", "=5", "\x7fELF", "é", "<html>"])
def test_binary_is_an_error(printer, line):
    with pytest.raises(CommandError, match="is no G-code command"):
        printer.gcode.run_script(line)


def test_error_is_reported_once_and_raised(printer):
    def run_inner(gcmd):
        printer.gcode.run_script_from_command("FAIL")

    def fail(gcmd):
        raise gcmd.error("first\nsecond")
    printer.gcode.register_command("FAIL", fail)
    printer.gcode.register_command("OUTER", run_inner)
    with pytest.raises(CommandError, match="first"):
        printer.gcode.run_script("OUTER\nNEVER_RUN")
    assert printer.output == ["// second", "!! first"]
    assert printer.events.count(("gcode:command_error",)) == 1
    assert not printer.gcode.get_mutex().test()


def test_defect_in_a_handler_is_an_error_with_its_place(printer, caplog):
    printer.gcode.register_command("BAD", lambda gcmd: {}["x"])
    with pytest.raises(CommandError, match=r"'BAD 1': KeyError.*test_gcode.py:\d+"):
        printer.gcode.run_script("BAD 1")
    assert "internal error in command" in caplog.text
    assert printer.state == "ready"


def test_registration(printer, calls):
    registry = printer.gcode
    with pytest.raises(ConfigError, match="already registered"):
        registry.register_command("FOO", print)
    for name in ("foo", "1A", "A B", ""):
        with pytest.raises(ConfigError, match="is no name"):
            registry.register_command(name, print)
    assert registry.register_command("FOO", None) == calls.append
    assert registry.register_command("FOO", None) is None
    registry.register_command("FOO", print, desc="Does foo")
    assert registry.get_status(0.)["commands"]["FOO"] == {"help": "Does foo"}
    assert registry.get_command_help()["FOO"] == "Does foo"


def test_mux(printer):
    seen = []
    registry = printer.gcode
    registry.register_mux_command("SET", "PIN", "a", lambda c: seen.append("a"), "h")
    registry.register_mux_command("SET", "PIN", "b", lambda c: seen.append("b"))
    registry.run_script("SET PIN=b\nset pin=a")
    assert seen == ["b", "a"] and registry.gcode_help["SET"] == "h"
    with pytest.raises(CommandError, match="no PIN 'c': known are a, b"):
        registry.run_script("SET PIN=c")
    with pytest.raises(CommandError, match="PIN is missing"):
        registry.run_script("SET")
    registry.register_mux_command("SET", "PIN", None, lambda c: seen.append(None))
    registry.run_script("SET")
    assert seen[-1] is None
    with pytest.raises(ConfigError, match="selected by PIN"):
        registry.register_mux_command("SET", "LED", "a", print)
    with pytest.raises(ConfigError, match="already registered"):
        registry.register_mux_command("SET", "PIN", "a", print)


def test_sink_takes_plain_moves(printer, calls):
    sink = Sink()
    printer.gcode.set_move_sink(sink)
    printer.gcode.run_script("G1 X5 E1\nG0 X6\nG1 X=5\nFOO")
    assert sink.moves == [(9, 5., 1.), (1, 6., 1.)]
    assert [c.get_command() for c in calls] == ["G1", "FOO"]


def test_sink_is_bypassed_while_g1_is_replaced(printer, calls):
    sink, seen = Sink(), []
    printer.gcode.set_move_sink(sink)
    old = printer.gcode.register_command("G1", None)
    printer.gcode.register_command("G1", seen.append)
    printer.gcode.run_script("G1 X5\nG0 X5")
    assert len(seen) == 1 and calls[0].get_command() == "G0" and not sink.moves
    printer.gcode.register_command("G1", None)
    printer.gcode.register_command("G1", old)
    printer.gcode.run_script("G1 X5")
    assert len(sink.moves) == 1
    printer.gcode.ready_gcode_handlers["G0"] = seen.append
    printer.gcode.run_script("G1 X5")
    assert len(sink.moves) == 1


def test_errors_of_the_sink(printer, calls):
    printer.gcode.set_move_sink(Sink())
    with pytest.raises(CommandError, match="out of range"):
        printer.gcode.run_script("G1 X101")
    with pytest.raises(CommandError, match="'G1 X-101': ZeroDivisionError"):
        printer.gcode.run_script("G1 X-101")


def test_states_and_core_commands(printer):
    printer.gcode.register_command("FOO", print)
    printer.gcode.run_script("STATUS\nECHO hi\nM110 N5\nM115\nHELP")
    assert printer.output[:3] == [
        "// Klipper state: Ready", "// ECHO hi",
        "// FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v1"]
    assert "// RESTART   : Read the config" in printer.output[3]
    printer.gcode.run_script("M112")
    assert printer.message == "Shutdown due to M112 command"
    with pytest.raises(CommandError, match="Shutdown due to M112"):
        printer.gcode.run_script("FOO")
    assert "FOO" not in printer.gcode.get_status(0.)["commands"]
    printer.gcode.run_script("STATUS")
    assert printer.output[-1].endswith("// Klipper state: Not ready")
    printer.gcode.run_script("FIRMWARE_RESTART")
    assert printer.exit_result == "firmware_restart"


def test_unknown_commands_and_slicer_habits(printer):
    printer.gcode.run_script(
        "M900 K0.1\nM900 K0.2\nM107\nM106 S0\nM104 S0\nM140\nM21\nNO_SUCH X=1")
    assert printer.output == [
        "// M900 (linear advance) is ignored: set this in the config file",
        '// Unknown command:"NO_SUCH"']
    printer.gcode.run_script("M862.3 P \"MK3S\"\nM106 S1\nP1START 'unclosed")
    assert printer.output[2:] == ['// Unknown command:"M862.3"',
                                  '// Unknown command:"M106"',
                                  '// Unknown command:"P1"']


def test_terminal_line_answers_ok(printer, calls):
    registry = printer.gcode
    for line in ("M115", "M105", "FOO", "", "; c", "BAD=1"):
        registry.run_terminal_line(line)
    assert printer.output == [
        "ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v1", "ok T:0", "ok", "ok", "ok",
        '// Unknown command:"BAD"', "ok"]
    printer.output.clear()
    assert not registry.run_terminal_line("\1")
    assert printer.output == [r"!! '\x01' is no G-code command", "ok"]
    registry.set_move_sink(Sink())
    assert registry.run_terminal_line("G1 X1")
    assert printer.output[-1] == "ok"


def test_scripts_wait_for_each_other(printer):
    order = []

    def wait(gcmd):
        order.append("start")
        printer.reactor.pause(printer.reactor.monotonic() + 2.)
        order.append("end")
    printer.gcode.register_command("WAIT", wait)
    for _ in range(2):
        printer.reactor.register_callback(lambda e: printer.gcode.run_script("WAIT"))
    printer.run_for(1.)
    assert order == ["start"] and printer.gcode.mutex.n_waiting == 1
    printer.run_for(5.)
    assert order == ["start", "end", "start", "end"]
    assert printer.gcode.mutex.n_waiting == 0


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=60))
def test_any_text_ends_in_a_command_error_at_worst(text):
    logging.disable(logging.CRITICAL)
    printer = make_printer()
    try:
        for line in text.split("\n"):
            printer.gcode.run_terminal_line(line)
        if printer.state == "ready":
            oks = [out for out in printer.output if out.startswith("ok")]
            assert len(oks) == text.count("\n") + 1
    finally:
        logging.disable(logging.NOTSET)
        printer.close()


def test_commands_that_give_way(printer):
    gcode, calls = printer.gcode, []

    def make(name):
        return lambda gcmd: calls.append(name)
    gcode.register_command("EXTRA_A", make("own"), desc="own", yields=True)
    gcode.register_command("EXTRA_A", make("macro"), desc="macro")
    gcode.register_command("EXTRA_B", make("macro"))
    gcode.register_command("EXTRA_B", make("own"), yields=True)
    gcode.register_mux_command("EXTRA_C", "KEY", "1", make("own"), yields=True)
    gcode.register_command("EXTRA_C", make("macro"))
    gcode.register_mux_command("EXTRA_C", "KEY", "2", make("own"), yields=True)
    gcode.register_command("EXTRA_D", make("own"), yields=True)
    for script in ("EXTRA_A", "EXTRA_B", "EXTRA_C KEY=1", "EXTRA_D"):
        gcode.run_script(script)
    assert calls == ["macro", "macro", "macro", "own"]
    assert gcode.get_command_help()["EXTRA_A"] == "macro"
    for name in ("EXTRA_A", "EXTRA_B", "EXTRA_C"):
        with pytest.raises(printer.config_error, match="already registered"):
            gcode.register_command(name, make("other"))
