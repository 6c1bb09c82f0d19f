# SPDX-License-Identifier: GPL-3.0-or-later
"""The service: its files, and what systemd itself says of them."""

import configparser
import getpass
import os
import re
import shutil
import subprocess
import sys

import pytest

from klippy import cli
from klippy.cli import service_files

needs_systemd = pytest.mark.skipif(not shutil.which("systemd-analyze"),
                                   reason="there is no systemd-analyze here")
MAX_EXPOSURE = 3.0      # of 10, by systemd-analyze security


def install(root, *options):
    return cli.main(["install-service", "--user", getpass.getuser(), "--data",
                     "/home/pi/printer_data", "--root", str(root), *options])


def read_unit(path):
    parser = configparser.RawConfigParser(strict=False, delimiters="=")
    parser.optionxform = str
    parser.read_string(path.read_text())
    return parser["Service"]


def test_writes_unit_rules_and_folders(tmp_path, capsys):
    assert install(tmp_path) == 0
    unit = read_unit(tmp_path / "etc/systemd/system/klipper.service")
    command = unit["ExecStart"].replace("\\\n", " ").split()
    assert command[0] == sys.executable
    assert "/home/pi/printer_data/config/printer.cfg" in command
    assert unit["Type"] == "notify" and int(unit["WatchdogSec"]) > 5
    assert unit["Restart"] == "always" and unit["User"] == getpass.getuser()
    for name in ("config", "logs", "gcodes", "comms"):
        assert (tmp_path / "home/pi/printer_data" / name).is_dir()
    rules = (tmp_path / "etc/udev/rules.d/60-klippy.rules").read_text()
    assert re.search(
        r'ATTRS{idVendor}=="1d50", ATTRS{idProduct}=="614e", .*MODE="0660"', rules)
    assert "printer.cfg" in capsys.readouterr().out
    (tmp_path / "home/pi/printer_data/config/printer.cfg").write_text("[mcu]\n")
    assert install(tmp_path) == 0       # again: nothing is lost
    assert (tmp_path / "home/pi/printer_data/config/printer.cfg").read_text()


def test_command_of_the_unit_runs_anywhere(tmp_path):
    assert install(tmp_path) == 0
    unit = read_unit(tmp_path / "etc/systemd/system/klipper.service")
    command = unit["ExecStart"].replace("\\\n", " ").split()
    environment = {name: value for name, value in os.environ.items()
                   if name != "PYTHONPATH"}
    text = subprocess.run([*command[:3], "--help"], capture_output=True, text=True,
                          check=True, cwd="/", env=environment).stdout
    options = [word for word in command if word.startswith("--")]
    assert len(options) == 3 and all(option + " " in text for option in options)


def test_several_printers(tmp_path):
    assert install(tmp_path, "--template", "--printer", "left",
                   "--printer", "right") == 0
    unit = (tmp_path / "etc/systemd/system/klipper@.service").read_text()
    assert " run /home/pi/printer_data_%i/config/printer.cfg" in unit
    for name in ("left", "right"):
        assert (tmp_path / ("home/pi/printer_data_" + name) / "config").is_dir()
    assert not (tmp_path / "home/pi/printer_data").exists()


def test_only_print(tmp_path, capsys):
    assert install(tmp_path, "--print") == 0
    assert "[Service]" in capsys.readouterr().out and not list(tmp_path.iterdir())


@pytest.mark.parametrize("options, text", [
    (("--user", "no_such_user"), "no user 'no_such_user'"),
    (("--data", "relative"), "absolute path"),
    (("--data", "/has space"), "absolute path"),
    (("--data", "/50%"), "absolute path"),
    (("--name", "a/b"), "letters, digits"),
    (("--printer", "left"), "belongs to --template"),
    (("--template", "--printer", "../x"), "letters, digits"),
    (("--root", "/proc/none"), "/proc/none")])
def test_what_cannot_be_is_told(tmp_path, capsys, options, text):
    assert install(tmp_path, *options) == 1
    assert text in capsys.readouterr().err and not list(tmp_path.iterdir())


@needs_systemd
@pytest.mark.parametrize("options", [(), ("--template",)])
def test_systemd_finds_no_fault(tmp_path, options):
    assert install(tmp_path, *options) == 0
    unit, = (tmp_path / "etc/systemd/system").iterdir()
    result = subprocess.run(["systemd-analyze", "verify", str(unit)],
                            capture_output=True, text=True, timeout=60)
    assert result.returncode == 0 and unit.name not in result.stderr, result.stderr


@needs_systemd
def test_has_few_rights(tmp_path):
    # of the unit's own settings: who calls the test may be root, nobody should
    unit = tmp_path / "klipper.service"
    unit.write_text(service_files.Service("daemon", "/home/pi/data",
                                          sys.executable).make_unit())
    result = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", "--no-pager", str(unit)],
        capture_output=True, text=True, timeout=60)
    level = re.search(r"exposure level for \S+: ([\d.]+)", result.stdout)
    if level is None:
        pytest.skip("this systemd-analyze judges no files")
    assert float(level[1]) <= MAX_EXPOSURE
