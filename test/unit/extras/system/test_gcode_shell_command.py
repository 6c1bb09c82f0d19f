# SPDX-License-Identifier: GPL-3.0-or-later
"""RUN_SHELL_COMMAND: arguments, output, time limits, and what may not hold it up."""
import os
import time

import pytest
from front_end import make_printer

from klippy.errors import CommandError
from klippy.extras import gcode_shell_command


def make(command, **options):
    options = {"command": command, "timeout": "20", "verbose": "True", **options}
    return make_printer(("gcode_shell_command job", options))


@pytest.fixture
def run():
    """run(command, line, **options) gives the terminal's lines."""
    printers = []

    def run_line(command, line="RUN_SHELL_COMMAND CMD=job", **options):
        printers.append(make(command, **options))
        printers[-1].gcode.run_script(line)
        return printers[-1].output
    yield run_line
    for printer in printers:
        printer.close()


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with open("/proc/%d/stat" % (pid,)) as file:
        return file.read().rpartition(")")[2].split()[0] != "Z"


def wait_for(condition):
    """A process of the computer takes its real time."""
    for _ in range(2000):
        if condition():
            return True
        time.sleep(0.005)
    return False


def test_output_and_end(run):
    assert [line for text in run("sh -c 'echo one; echo two >&2; printf three'")
            for line in text.splitlines()] == [
        "// Running command job", "// one", "// two", "// three",
        "// Command job finished"]


def test_params_are_words_and_no_shell_text(run):
    out = run("printf '<%s>\\n' a", "RUN_SHELL_COMMAND CMD=job"
              " PARAMS=\"b 'c d' $HOME ;ls\"")
    assert [line for text in out[1:-1] for line in text.splitlines()] == [
        "// <a>", "// <b>", "// <c d>", "// <$HOME>", "// <;ls>"]


def test_quiet(run):
    assert run("echo hello", verbose="False") == []


@pytest.mark.parametrize("command, text", [
    ("sh -c 'exit 3'", "// Command job: it ended with status 3"),
    ("/no/such/program", "// Command job: it cannot be run: No such file or directory"),
])
def test_failures_are_told_and_the_gcode_goes_on(run, command, text):
    out = run(command, "RUN_SHELL_COMMAND CMD=job\nECHO on", verbose="False")
    assert out[0] == text and out[1].endswith("on")


def test_bad_params(run):
    with pytest.raises(CommandError, match="No closing quotation"):
        run("echo", "RUN_SHELL_COMMAND CMD=job PARAMS=\"'a\"")


def test_time_limit_ends_the_whole_group(run, tmp_path):
    note = tmp_path / "pid"
    out = run("sh -c 'trap \"\" TERM; sh -c \"trap : TERM; echo \\$\\$ >%s;"
              " while :; do sleep 1; done\" & wait; sleep 100'" % (note,),
              timeout="0.4")
    assert out[-1] == "// Command job: it took more than 0.4 s and was ended"
    assert wait_for(lambda: not is_alive(int(note.read_text())))


def test_timers_run_meanwhile():
    printer = make("sleep 0.2")
    beats = []

    def beat(eventtime):
        beats.append(eventtime)
        return eventtime + 0.1
    printer.reactor.register_timer(beat, printer.reactor.NOW)
    printer.gcode.run_script("RUN_SHELL_COMMAND CMD=job")
    assert len(beats) > 10
    printer.close()


def test_waits_end_from_outside(tmp_path):
    printer, note = make("sh -c 'echo $$ >%s; exec sleep 100'" % (tmp_path / "p",),
                         timeout="100"), tmp_path / "p"

    def end(eventtime):
        if not note.exists() or not note.read_text():
            return eventtime + 0.01
        assert printer.gcode.interrupts.end_waits() == 1
        return printer.reactor.NEVER
    printer.reactor.register_timer(end, printer.reactor.NOW)
    printer.gcode.run_script("RUN_SHELL_COMMAND CMD=job")
    assert printer.output[-1] == "// Command job: it was ended"
    assert wait_for(lambda: not is_alive(int(note.read_text())))
    printer.close()


def test_output_has_an_end(run, monkeypatch):
    monkeypatch.setattr(gcode_shell_command, "MAX_OUTPUT", 8192)
    out = run("sh -c 'yes | head -c 100000'")
    assert sum(map(len, out)) < 40000
    assert "// (further output is not shown)" in out
    assert out[-1] == "// Command job finished"


def test_a_child_in_the_background_holds_up_nothing(run):
    out = run("sh -c 'sleep 20 & echo done'")
    assert out[-1] == "// Command job finished"


def test_not_in_a_batch_run(tmp_path):
    printer = make_printer(
        ("gcode_shell_command job", {"command": "touch %s/x" % (tmp_path,)}),
        debugoutput="out")
    printer.gcode.run_script("RUN_SHELL_COMMAND CMD=job")
    assert printer.output == ["// Command job is not run in a batch run"]
    assert not (tmp_path / "x").exists()
    printer.close()
