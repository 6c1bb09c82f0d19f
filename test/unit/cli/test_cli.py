# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: finding sub-commands, exit statuses."""

import argparse
import grp
import json
import os
import pathlib
import socket
import subprocess
import sys

import pytest

from klippy import api_socket, cli
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


@pytest.mark.parametrize("columns, limit", [("50", 48), ("many", 78), ("0", 78)])
def test_help_fits_the_terminal(capsys, monkeypatch, columns, limit):
    """Also where its width is nonsense or unknown."""
    monkeypatch.setenv("COLUMNS", columns)
    with pytest.raises(SystemExit):
        cli.main(["run", "--help"])
    assert 20 < max(map(len, capsys.readouterr().out.splitlines())) <= limit


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


def test_misspelt_command_is_told(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["chek", "printer.cfg"]) == 2
    assert "'chek'; did you mean 'check'?" in capsys.readouterr().err
    assert cli.main(["zzzz"]) == 2
    assert "klippy --help" in capsys.readouterr().err


def test_config_without_suffix_is_a_config(monkeypatch, tmp_path):
    seen = []
    monkeypatch.setattr(run_module, "run", seen.append)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "myprinter").write_text("")
    assert cli.main(["myprinter"]) == 0 and seen[0].config == "myprinter"


def run_klippy(*args, stdout):
    return subprocess.Popen([sys.executable, "-m", "klippy", *args], cwd=ROOT,
                            stdout=stdout, stderr=subprocess.PIPE, text=True)


def test_reader_that_goes_away_is_no_traceback():
    process = run_klippy("schema", stdout=subprocess.PIPE)
    process.stdout.read(10)
    process.stdout.close()
    errors = process.stderr.read()
    assert process.wait() == 1 and errors == ""


def read_demo(*args):
    """(exit status, what klippy demo said)."""
    process = run_klippy("demo", *map(str, args), stdout=subprocess.PIPE)
    output, errors = process.communicate()
    assert "Traceback" not in output + errors
    return process.returncode, output + errors


def test_demo_tells_what_it_cannot_read_or_write(tmp_path):
    job, file = tmp_path / "short.gcode", tmp_path / "file"
    job.write_text("G28\n")
    file.write_text("precious")
    status, text = read_demo(tmp_path)
    assert status == 1 and "it is a folder" in text
    status, text = read_demo(job, "--report", file)
    assert status == 1 and "Unable to make the folder '%s'" % (file,) in text
    status, text = read_demo(job, "--log", tmp_path / "no" / "log")
    assert status == 1 and "unable to write the log" in text
    (tmp_path / "rep" / "report.html").mkdir(parents=True)
    status, text = read_demo(job, "--report", tmp_path / "rep")
    assert status == 1 and "is not complete: Is a directory" in text
    assert file.read_text() == "precious"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
def test_full_disk_under_the_output_is_told():
    with open("/dev/full", "w") as full:
        process = run_klippy("--help", stdout=full)
        errors = process.stderr.read()
    assert process.wait() == 1
    assert errors == ("klippy: No space left on device: what was to be written is not"
                      " complete\n")


def start_daemon(config, **paths):
    """Exit status of a daemon that should not run at all."""
    args = [str(config), "-n"] if "tty" not in paths else [
        str(config), "-I", str(paths["tty"])]
    for name, option in (("api", "-a"), ("log", "-l")):
        if name in paths:
            args += [option, str(paths[name])]
    return cli.main(args)


def test_second_daemon_leaves_the_first_ones_tty(tmp_path, capsys):
    """It gives up when the API socket is served, before it takes the tty over."""
    tty, api = tmp_path / "tty", tmp_path / "uds"
    tty.symlink_to("/dev/pts/12345")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(api))
        server.listen()
        assert start_daemon("p.cfg", tty=tty, api=api) == 2
    assert "another program, maybe klippy, serves it" in capsys.readouterr().err
    assert os.readlink(tty) == "/dev/pts/12345" and api.exists()


def test_other_files_stay_where_a_socket_or_tty_goes(tmp_path, capsys):
    precious = tmp_path / "precious"
    precious.write_text("x")
    assert start_daemon("p.cfg", tty=tmp_path / "tty", api=precious) == 2
    assert "there is a file of that name" in capsys.readouterr().err
    assert start_daemon("p.cfg", tty=precious) == 2
    assert "Unable to make the G-code tty" in capsys.readouterr().err
    assert precious.read_text() == "x" and not (tmp_path / "tty").exists()


def test_log_that_cannot_be_written_is_told_once(tmp_path, capsys, caplog):
    assert start_daemon("p.cfg", log=tmp_path / "no" / "x.log") == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "No such file or directory" in error
    assert "Unable to write the log file" in error and not caplog.records


def test_console_tells_at_once_of_what_is_no_device(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for name, what in (("file", "but a file"), ("", "but a folder")):
        assert cli.main(["console", str(tmp_path / name)]) == 1
        assert what in capsys.readouterr().err


def test_access_to_the_socket(tmp_path):
    path = str(tmp_path / "socket")
    parser = argparse.ArgumentParser()
    run_module.add_arguments(parser)
    options = parser.parse_args(
        ["-n", "--api-server-file-mode", "640", "--api-server-user", str(os.getuid()),
         "--api-server-group", grp.getgrgid(os.getgid()).gr_name])
    daemon = run_module.Daemon(options)
    daemon._make_start_args()
    with socket.socket(socket.AF_UNIX) as sock:
        sock.bind(path)
        api_socket.set_access(path, daemon.start_args)
        status = os.stat(path)
    assert status.st_mode & 0o777 == 0o640
    assert (status.st_uid, status.st_gid) == (os.getuid(), os.getgid())
    for wrong in (["--api-server-file-mode", "999"], ["--api-server-file-mode", "7777"],
                  ["--api-server-user", "no such user"],
                  ["--api-server-group", "no such group"]):
        with pytest.raises(SystemExit):
            parser.parse_args(wrong)
