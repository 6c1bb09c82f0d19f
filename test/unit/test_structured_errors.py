# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of a config as data: to a client of the real daemon's socket, as text too."""
import json
import pathlib

import pytest
from daemon_run import Host

from klippy import cli
from klippy.configtext import ConfigReader

SAMPLE = pathlib.Path(__file__).resolve().parents[2] / "config/sample-cartesian.cfg"
TEXT = SAMPLE.read_text()
# (line as it is, line as it gets, section, option, nearest, text the column is at)
CASES = [
    ("max_z_velocity: 25", "max_z_velocty: 25", "printer", "max_z_velocty",
     "max_z_velocity", "max_z_velocty"),
    ("max_accel: 3000", "max_accel:   fast", "printer", "max_accel", None, "fast"),
    ("control: watermark", "control = watermrak", "heater_bed", "control", "watermark",
     "watermrak"),
    ("[pause_resume]", "[pause_resum]", "pause_resum", None, "pause_resume",
     "[pause_resum]"),
]


def run_check(path, capsys):
    assert cli.main(["check", str(path), "--json"]) == 1
    return json.loads(capsys.readouterr().out)["errors"]


@pytest.mark.parametrize("old, new, section, option, nearest, at", CASES)
def test_check_tells_place_and_names(old, new, section, option, nearest, at, tmp_path,
                                     capsys):
    path = tmp_path / "printer.cfg"
    assert TEXT.count(old + "\n") == 1
    path.write_text(TEXT.replace(old + "\n", new + "\n"))
    found = [error for error in run_check(path, capsys) if error["section"] == section
             and error["option"] == option]
    assert len(found) == 1
    error, = found
    lines = path.read_text().splitlines()
    assert error["file"] == str(path) and error["nearest"] == nearest
    assert lines[error["line"] - 1][error["column"] - 1:].startswith(at)
    assert cli.main(["check", str(path)]) == 1
    place = "error: %s:%d:%d: " % (path, error["line"], error["column"])
    assert place + error["message"] in capsys.readouterr().err


def test_option_that_must_be_set(tmp_path, capsys):
    path = tmp_path / "printer.cfg"
    path.write_text(TEXT.replace("max_velocity: 300\n", "max_velocty: 300\n"))
    error = next(error for error in run_check(path, capsys)
                 if error["option"] == "max_velocity")
    assert (error["section"], error["nearest"]) == ("printer", "max_velocty")


def test_error_of_a_module_is_located(tmp_path, capsys):
    path = tmp_path / "printer.cfg"
    path.write_text(TEXT + "[servo s]\npin: ^P1\n")
    error, = run_check(path, capsys)
    lines = path.read_text().splitlines()
    assert error["section"] == "servo s"
    assert lines[error["line"] - 1] in ("[servo s]", "pin: ^P1")


def test_columns_of_saved_values(tmp_path):
    path = tmp_path / "printer.cfg"
    path.write_text("  [fan]\n  pin:  PH6\n\n#*# <---------------------- SAVE_CONFIG"
                    " ---------------------->\n#*# DO NOT EDIT THIS BLOCK OR BELOW."
                    "\n#*#\n#*# [fan]\n#*# max_power = 0.5\n")
    store = ConfigReader().read(str(path))
    lines = path.read_text().splitlines()
    for option, value in (("pin", "PH6"), ("max_power", "0.5")):
        place = store.get_place("fan", option)
        line = lines[place.line - 1]
        assert line[place.column - 1:].startswith(option)
        assert line[place.at_value().column - 1:] == value


def test_client_of_the_daemon_gets_them(tmp_path, capsys):
    text = TEXT
    # those that do not keep others from being looked for
    cases = CASES[2:]
    for old, new, *_ in cases:
        text = text.replace(old + "\n", new + "\n")
    found = {}

    host = Host(tmp_path, TEXT)
    host.config_path.write_text(text)
    host.run_boots(lambda host: found.update(host.info()))
    info, path = found, host.config_path
    assert info["state"] == "error"
    named = {(error["section"], error["option"], error["nearest"])
             for error in info["errors"]}
    assert {case[2:5] for case in cases} <= named
    for error in info["errors"]:
        assert error["message"] in info["state_message"]
    assert info["errors"] == run_check(path, capsys)
