# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of printer.cfg: each is told with its place and remedy, the daemon
stays up, and RESTART after the repair gives a printer that works."""

import os
import re

import pytest
from machine_configs import BED, make_axes

from klippy.cli import main

GOOD = make_axes("cartesian", extra=BED)
N_LINES = GOOD.count("\n")


def replace(old, new, offset=0):
    """(config, place of the fault: offset lines below the start of old)."""
    before, found, after = GOOD.partition(old)
    assert found
    return (before + new + after,
            "printer.cfg:%d" % (before.count("\n") + 1 + offset))


def append(text, place="printer.cfg:%d" % (N_LINES + 1)):
    """(config, place of the first line of text)."""
    return GOOD + text, place


# config, place of the fault, what the text must say: fault, then remedy
STEPS = "microsteps: 16\n"
FAULTS = {
    "include_cycle": (*append("[include other.cfg]\n", "other.cfg:1"),
                      "goes in a circle", "remove"),
    "missing_include": (*append("[include none.cfg]\n"), "there is no file",
                        "correct the name"),
    "include_of_folder": (*append("[include folder]\n"), "Is a directory",
                          "name a file"),
    "unknown_option": (*replace("pin: PF6\n", "pin: PF6\nmax_powr: 1\n", 1),
                       "no option 'max_powr'", "did you mean 'max_power'"),
    "strange_option": (*replace("pin: PF6\n", "pin: PF6\nzzz: 1\n", 1),
                       "no option 'zzz'", "remove it"),
    "unknown_section": (*append("[fann]\npin: PF7\n"), "section kind [fann]",
                        "did you mean [fan]"),
    "strange_section": (*append("[qqqqqqqq]\npin: PF7\n"), "section kind [qqqqqqqq]",
                        "install the plug-in"),
    # told at the header
    "missing_option": (*replace(STEPS, "", -3), "option 'microsteps' in section"
                       " [stepper_x]", "must be set"),
    "ill_typed": (*replace(STEPS, "microsteps: many\n"), "'many'", "a whole number"),
    "not_finite": (*replace("max_velocity: 300", "max_velocity: nan"), "'nan'",
                   "a finite number"),
    "range": (*replace("max_velocity: 300", "max_velocity: -3"), "'-3'",
              "must be above 0"),
    "choice": (*replace("control: watermark", "control: watermrk"), "'watermrk'",
               "did you mean 'watermark'"),
    "gear_ratio": (*replace(STEPS, "gear_ratio: 0:1\n" + STEPS), "'0:1'",
                   "two numbers above 0"),
    "bad_pin_name": (*replace("pin: PF6", "pin: PQ6"), "Pin 'PQ6' is not a valid pin",
                     "did you mean 'PF6'"),
    "bad_pin_format": (*replace("pin: PF6", "pin: !!PF6"), "'!!PF6'", "the format is"),
    "pin_used_twice": (*replace("pin: PF6", "pin: PA0"), "'PA0' is used more than once",
                       "[duplicate_pin_override]"),
    "not_utf8": (*replace("pin: PF6", "pin: P\udcff6"), "'pin: P\\xff6' is not UTF-8",
                 "save the file as UTF-8"),
    "nul": (*replace("pin: PF6", "pin: P\0F6"), "a NUL byte", "take it out"),
    "no_value": (*replace("pin: PF6", "pin"), "'pin' is not an option",
                 "write name: value"),
    "open_header": (*append("[fan\n"), "'[fan' is not a section header",
                    "write [name]"),
}
# faults that have no line: nothing is there to point to
FILE_FAULTS = {
    "empty": (b"", "section [mcu] is missing", "restore it"),
    "only_comments": (b"# nothing\n\n", "section [mcu] is missing", "restore it"),
    "no_printer": (GOOD.replace("[printer]", "[printr]").encode(),
                   "section [printer] is missing", "did you mean [printer]"),
    "binary": (bytes(range(256)) * 40, ":1: a NUL byte", "restore the file"),
}
WARNINGS = {
    "section_twice": (*append("[fan]\nmax_power: 0.5\n"),
                      "section [fan] was there already"),
    "option_twice": (*replace("pin: PF6\n", "pin: PF5\npin: PF6\n", 1),
                     "option 'pin' of section [fan] was set in line"),
}


@pytest.fixture
def host(make_host, tmp_path):
    (tmp_path / "other.cfg").write_text("[include printer.cfg]\n")
    (tmp_path / "folder").mkdir()
    return make_host(GOOD)


def write(host, text):
    data = text if isinstance(text, bytes) else text.encode("utf-8", "surrogateescape")
    host.config_path.write_bytes(data)


def check_told(host, wanted, remedy):
    """The state is error, and its message says all; returns the message."""
    info = host.info()
    message = info["state_message"]
    assert info["state"] == "error" and "RESTART" in message
    assert wanted in message and remedy in message
    assert "Traceback" not in message and message.isascii()
    assert host.status("webhooks")["state"] == "error"
    host.script("STATUS")
    assert any(wanted in text for text in host.output)
    return message


def check_works(host):
    assert host.info()["state"] == "ready"
    host.script("G28\nG1 X10 F6000\nM400")
    assert host.machine.calc_position() == pytest.approx((10., 0., 0.), abs=0.02)


def run_faulty(host, text, check):
    """Boot with a faulty config, RESTART with it, repair it, RESTART."""
    def repair(host):
        check(host)
        host.config_path.unlink()
        write(host, GOOD)
    write(host, text)
    host.run_boots(check, repair, check_works)
    assert host.boots == 3


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_told_and_repaired(host, name):
    text, place, wanted, remedy = FAULTS[name]

    def check(host):
        message = check_told(host, wanted, remedy)
        # the path ends with it, and so does the number
        assert re.search(r"/%s\b" % (re.escape(place),), message)
        # one fault, one error: no others follow from it
        assert len(message.split("\n\n")[0].splitlines()) == 1
    run_faulty(host, text, check)


@pytest.mark.parametrize("name", FILE_FAULTS)
def test_file_fault_is_told_and_repaired(host, name):
    data, wanted, remedy = FILE_FAULTS[name]

    def check(host):
        assert str(host.config_path) in check_told(host, wanted, remedy)
    run_faulty(host, data, check)


@pytest.mark.parametrize("kind", ["missing", "folder", "loop", "forbidden"])
def test_unreadable_file_is_told_and_repaired(host, kind):
    path = host.config_path
    if kind == "forbidden" and os.geteuid() == 0:
        pytest.skip("root may read everything")
    remedy = {"missing": "create it", "folder": "name a file", "loop": "the link",
              "forbidden": "let the user"}[kind]

    def check(host):
        assert str(path) in check_told(host, "unable to read the config file", remedy)

    def repair(host):
        check(host)
        if kind == "folder":
            path.rmdir()
        path.unlink(missing_ok=True)
        write(host, GOOD)
    if kind == "forbidden":
        path.chmod(0)
    else:
        path.unlink()
    if kind == "folder":
        path.mkdir()
    elif kind == "loop":
        path.symlink_to(path)
    host.run_boots(check, repair, check_works)


@pytest.mark.parametrize("name", WARNINGS)
def test_doubled_names_are_a_warning(host, name, capsys):
    text, place, wanted = WARNINGS[name]
    write(host, text)

    def check(host):
        check_works(host)
        (warning,) = host.status("configfile")["warnings"]
        assert wanted in warning["message"]
        assert place + ": " in warning["message"]
    host.run_boots(check)
    assert main(["check", str(host.config_path)]) == 0
    assert wanted in capsys.readouterr().out


@pytest.mark.parametrize("name", sorted(set(FAULTS) - {"bad_pin_name"}))
def test_check_command_tells_the_same(host, name, capsys):
    text, place, wanted, remedy = FAULTS[name]
    write(host, text)
    assert main(["check", str(host.config_path)]) == 1
    printed = capsys.readouterr().err
    assert wanted in printed and remedy in printed and "1 error(s)" in printed
    assert place in printed and printed.isascii()


def test_all_faults_are_told_at_once(host):
    text = (GOOD.replace("max_temp: 130", "max_temp: hot").replace(
        "pin: PF6", "pinn: PF6").replace("control: watermark", "control: x", 1)
        + "[nothing]\n[fann]\n")

    def check(host):
        message = check_told(host, "hot", "a finite number")
        for wanted in ("'pin' in section [fan] must be set", "'x'", "[nothing]",
                       "[fann]"):
            assert wanted in message
        assert len(message.split("\n\n")[0].splitlines()) == 5
    run_faulty(host, text, check)
