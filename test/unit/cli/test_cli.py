# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: finding sub-commands, exit statuses."""

import argparse
import json
import os
import pathlib
import subprocess
import sys

import pytest

from klippy import cli
from klippy.cli import run as run_module

ROOT = pathlib.Path(__file__).resolve().parents[3]


def test_every_command_has_help(capsys):
    names = [name for name, _ in cli.list_commands()]
    assert {"run", "check", "simulate", "demo", "dump"} <= set(names)
    assert cli.main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all("  %s " % (name,) in text for name in names)
    for name in names:
        with pytest.raises(SystemExit) as info:
            cli.main([name, "--help"])
        assert info.value.code == 0


def test_nothing_at_all_is_a_wrong_command_line(capsys):
    assert cli.main([]) == 2
    assert "usage" in capsys.readouterr().out


def test_bare_arguments_belong_to_run(monkeypatch):
    seen = []
    monkeypatch.setattr(run_module, "run", seen.append)
    cli.main(["printer.cfg", "-i", "a.gcode", "-o", "out", "-d", "main.dict",
              "-d", "tool=tool.dict", "-l", "x.log", "-a", "/tmp/api", "-I", "/tmp/p",
              "-v", "-n"])
    (options,) = seen
    assert options.config == "printer.cfg" and options.debuginput == "a.gcode"
    assert options.debugoutput == "out" and options.logfile == "x.log"
    assert options.api_server == "/tmp/api" and options.input_tty == "/tmp/p"
    assert options.verbose and options.no_tty and not options.import_test
    assert run_module.parse_dictionaries(options.dictionary) == {
        None: "main.dict", "tool": "tool.dict"}


def test_module_without_command_is_none():
    assert cli.find_command("simsession") is None
    assert cli.find_command("no_such_command") is None


def test_missing_files_are_told(capsys, tmp_path):
    assert cli.main(["run"]) == 2
    assert "name the printer.cfg" in capsys.readouterr().err
    assert cli.main(["p.cfg", "-i", str(tmp_path / "none.gcode"), "-o", "x"]) == 2
    assert "none.gcode" in capsys.readouterr().err
    assert cli.main(["p.cfg", "-n", "-l", str(tmp_path / "no" / "x.log")]) == 2
    assert "x.log" in capsys.readouterr().err


@pytest.mark.parametrize("command", [
    [str(ROOT / "klippy" / "klippy.py")], ["-m", "klippy"]])
def test_started_by_path_and_as_module(command, tmp_path):
    result = subprocess.run(
        [sys.executable, *command, "--help"], cwd=tmp_path, capture_output=True,
        text=True, check=True, env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert "klippy <command>" in result.stdout


def test_path_launcher_hides_the_flat_files(tmp_path):
    script = ("import runpy, sys; sys.argv = ['k', '--help']\n"
              "sys.path.insert(0, %r)\n"
              "try: runpy.run_path(%r, run_name='__main__')\n"
              "except SystemExit: pass\n"
              "assert 'printer' not in sys.modules\n"
              "import klippy; print(klippy.__path__, klippy.Printer.__module__)\n"
              % (str(ROOT / "klippy"), str(ROOT / "klippy" / "klippy.py")))
    result = subprocess.run([sys.executable, "-c", script], cwd=tmp_path,
                            capture_output=True, text=True, check=True)
    assert "klippy.printer" in result.stdout


def test_version_is_told(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("klippy ")


def test_check_as_json(tmp_path, capsys):
    path = tmp_path / "printer.cfg"
    text = (ROOT / "config" / "sample-cartesian.cfg").read_text()
    path.write_text(text.replace("max_accel: 3000", "max_accel: fast"))
    assert cli.main(["check", str(path), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    lines = path.read_text().splitlines()
    error, = found["errors"]
    assert error["kind"] == "ConfigError" and "'fast'" in error["message"]
    assert error["file"] == str(path) and lines[error["line"] - 1] == "max_accel: fast"
    path.write_text(text)
    assert cli.main(["check", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"errors": [], "warnings": []}


class Manager:
    """Stands where the service manager is told about printers: ends them all."""

    def __init__(self):
        self.states, self.restart = [], ["restart"]

    def watch(self, printer):
        reactor = printer.get_reactor()

        def follow(eventtime):
            state = printer.get_state_message()[1]
            if state == "startup":
                return eventtime + 0.1
            self.states.append((state, printer.get_start_args()["start_reason"]))
            printer.request_exit(self.restart.pop() if self.restart else "exit")
            return reactor.NEVER
        reactor.register_timer(follow, reactor.NOW)

    def send(self, **fields):
        self.states.append(fields)

    def close(self):
        pass


def test_run_drives_a_simulated_machine(tmp_path):
    parser = argparse.ArgumentParser()
    run_module.add_arguments(parser)
    config = ROOT / "config" / "sample-cartesian.cfg"
    daemon = run_module.Daemon(parser.parse_args([
        str(config), "--simulate", "--speed", "0", "-n"]))
    daemon.notifier = Manager()
    assert daemon.run() == 0
    assert daemon.notifier.states == [
        ("ready", "startup"), ("ready", "restart"), {"STOPPING": 1}]


def test_run_tells_why_there_is_no_simulated_machine(tmp_path, capsys):
    path = tmp_path / "printer.cfg"
    assert cli.main(["run", str(path), "--simulate", "-n"]) == 2
    assert "printer.cfg" in capsys.readouterr().err
