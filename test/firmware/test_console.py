# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy console` as a process, with the simulated mcu and the linux firmware."""

import os
import re
import signal
import subprocess
import sys

import pytest
from linux_board import LinuxProcess, build_linux
from simboard import ROOT

TIMEOUT = 180


def start(device, **options):
    """The command, with pipes to it."""
    return subprocess.Popen(
        [sys.executable, "-m", "klippy", "console", device], text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=dict(os.environ, PYTHONPATH=str(ROOT)), **options)


def talk(text, device="sim"):
    """Lines that the console shows for what is typed."""
    process = start(device)
    output, errors = process.communicate(text, timeout=TIMEOUT)
    assert (process.returncode, errors) == (0, "")
    lines = output.splitlines()
    assert lines[0].startswith("Connected to ")
    return lines[1:]


def find_answers(lines, name):
    """Fields of the answers of that name."""
    pattern = re.compile(r" *\d+\.\d{6}: %s (.*)" % (name,))
    found = [match[1] for match in map(pattern.fullmatch, lines) if match]
    return [{key: int(value) for key, value in re.findall(r"(\w+)=(\d+)", text)}
            for text in found]


def test_answers_and_values():
    lines = talk("get_config\n"
                 "SET wanted 3\nallocate_oids count={wanted}\n"
                 "# a remark\n\n"
                 "finalize_config crc={ wanted }\nget_config\n"
                 "get_uptime")              # the last line has no end
    assert [(a["is_config"], a["crc"]) for a in find_answers(lines, "config")] == [
        (0, 0), (1, 3)]
    assert len(find_answers(lines, "uptime")) == 1
    assert not [line for line in lines if "Error" in line]


def test_wiped_out_pin_and_shutdown():
    lines = talk("set_digital_out pin=gpio5 value=1\nset_digital_out pin=gpio999"
                 " value=1\nemergency_stop\nallocate_oids count=1\n")
    (error,) = [line for line in lines if line.startswith("Error")]
    assert "gpio999" in error
    assert any(re.search(r": shutdown clock=\d+ static_string_id=\w+", line)
               for line in lines)


def test_delay_and_flood():
    lines = talk("get_clock\nSUPPRESS config\nget_config\n"
                 "SUPPRESS uptime\nget_uptime\nFLOOD 5 0.01 debug_ping data=616263\n"
                 "DELAY {clock} debug_ping data=64\n")
    pongs = [line for line in lines if ": pong data=" in line]
    assert len(pongs) == 6 and sum("616263" in line for line in pongs) == 5
    times = [float(line.split(":")[0]) for line in pongs if "616263" in line]
    gaps = [later - sooner for sooner, later in zip(times, times[1:], strict=False)]
    assert all(gap == pytest.approx(0.01, abs=0.003) for gap in gaps)
    assert not find_answers(lines, "config") and not find_answers(lines, "uptime")


BAD = {
    "NOPE": "Unknown command 'NOPE'",
    "get_uptim": "did you mean 'get_uptime'",
    "get_uptime now": "does not have the fields",
    "get_uptime now=1": "now",
    "allocate_oids count=many": "'many'",
    "allocate_oids count={many}": "no value 'many', only clock, freq",
    "allocate_oids count={": "count",
    "allocate_oids count={freq.real}": "no value 'freq.real'",
    "allocate_oids count={0}": "no value '0'",
    '"get_uptime': "No closing quotation",
    "DELAY 12": "DELAY <clock> <command>",
    "DELAY soon get_uptime": "'soon'",
    "DELAY inf get_uptime": "infinity",
    "FLOOD 1": "FLOOD <count> <seconds> <command>",
    "FLOOD 1 nan get_uptime": "NaN",
    "FLOOD x 1 get_uptime": "'x'",
    "SET a": "SET <name> <value>",
    "SUPPRESS": "SUPPRESS <message> [oid]",
    "SUPPRESS clock x": "'x'",
    '""': "command",
}


def test_bad_lines_are_told_and_passed_over():
    lines = talk("SET clock 5\n" + "".join(line + "\n" for line in BAD)
                 + "get_uptime\n")
    errors = [line for line in lines if line.startswith("Error: ")]
    assert len(errors) == len(BAD), errors
    for message, error in zip(BAD.values(), errors, strict=True):
        assert message in error
    assert len(find_answers(lines, "uptime")) == 1


def test_lists_and_figures():
    lines = talk("LIST\nSTATS\nHELP\n")
    assert "command  get_uptime" in lines
    assert any(line.startswith("constant CLOCK_FREQ = ") for line in lines)
    assert any("bytes_write=" in line for line in lines)
    assert any(line.startswith("clock: mcu_freq=") for line in lines)
    assert any("FLOOD <count>" in line for line in lines)


def test_quit():
    assert not find_answers(talk("QUIT\nget_uptime\n"), "uptime")


def test_reader_that_goes():
    result = subprocess.run(
        ["bash", "-c", '(echo LIST; sleep 0.2; echo LIST; sleep 0.2; echo LIST)'
         ' | "$0" -m klippy console sim | head -n 1', sys.executable],
        capture_output=True, text=True, timeout=TIMEOUT,
        env=dict(os.environ, PYTHONPATH=str(ROOT)))
    assert result.stdout.startswith("Connected") and result.stderr == ""


def test_no_firmware(tmp_path):
    process = start("sim:%s" % (tmp_path / "none.so",))
    output, errors = process.communicate("", timeout=TIMEOUT)
    assert process.returncode == 1 and "none.so" in errors
    assert "Traceback" not in errors


@pytest.fixture
def firmware(tmp_path):
    process = LinuxProcess(build_linux(), tmp_path)
    yield process
    process.stop()


def test_linux_firmware(firmware):
    lines = talk("get_config\nget_uptime\nSTATS\n", firmware.link)
    assert [a["is_config"] for a in find_answers(lines, "config")] == [0]
    assert len(find_answers(lines, "uptime")) == 1
    # the board is free for the next one
    assert len(find_answers(talk("get_uptime\n", firmware.link), "uptime")) == 1


def test_board_that_dies(firmware):
    """It is told, and the console can be left."""
    process = start(firmware.link)
    assert process.stdout.readline().startswith("Connected")
    firmware.process.kill()
    assert "answers no longer" in process.stdout.readline()
    process.stdin.write("get_uptime\n")
    process.stdin.close()
    assert process.wait(TIMEOUT) == 0
    assert process.stderr.read() == ""


def test_interrupt_key(firmware):
    # A job in the background ignores the key, and what it starts does, too
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = start(firmware.link)
    signal.signal(signal.SIGINT, before)
    assert process.stdout.readline().startswith("Connected")
    process.send_signal(signal.SIGINT)
    assert process.wait(TIMEOUT) == 0
    assert process.stderr.read() == ""
