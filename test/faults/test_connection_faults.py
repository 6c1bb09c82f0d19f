# SPDX-License-Identifier: GPL-3.0-or-later
"""Links and boards that fail: one clear cause is told, the machine ends in a safe
state, the daemon stays up, and a restart after the repair prints again."""

import json
import logging
import os
import pathlib
import pty
import random
import re
import subprocess
import sys
import threading
import tty
import zlib

import pytest
from daemon_run import Host
from machine_configs import BED, make_axes, make_two_mcus

from klippy import serialhdl
from klippy.errors import McuError
from klippy.mcu.restart import McuRestart
from klippy.reactor import Reactor
from klippy_ext.hostclock import RealClock

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONFIG = make_axes("cartesian", extra=BED + "\n[virtual_sdcard]\npath: %s\n")
JOB = "G28\nM109 S200\nG90\nM83\nG1 X100 Y100 Z5 F6000\n" + "".join(
    "G1 X%d E0.02 F3000\nG1 Y%d E0.2\n" % (80 + i % 40, 80 + i * 7 % 40)
    for i in range(200)) + "M400\nM104 S0\n"
CONNECT_LIMIT = 200.            # s until the daemon gives up on a silent mcu


def make_config(folder):
    return CONFIG % (folder,)


@pytest.fixture
def all_logs(caplog):
    """caplog with all levels."""
    root = logging.getLogger()
    level = root.level
    caplog.set_level(logging.DEBUG)
    yield caplog
    root.setLevel(level)


@pytest.fixture
def job(tmp_path):
    (tmp_path / "job.gcode").write_text(JOB)
    return "job.gcode"


def start_print(host, name):
    host.script("SDCARD_PRINT_FILE FILENAME=" + name)


def wait_for_state(host, state, limit=CONNECT_LIMIT):
    """Let time pass until info tells this state; returns the message."""
    for _ in range(int(limit / 0.1)):
        info = host.info()
        if info["state"] == state:
            return info["state_message"]
        host.pause(0.1)
    raise AssertionError("the state is %s: %s"
                         % (info["state"], info["state_message"]))


def find_heater(host, name):
    return next(h for h in host.machine.thermal.heaters if h.name == name)


def print_to_the_end(host, name):
    """Print a file; returns where the machine is then."""
    start_print(host, name)
    for _ in range(4000):
        state = host.status("print_stats")["state"]
        if state != "printing":
            break
        host.pause(0.1)
    assert state == "complete", host.status("print_stats")
    return host.status("toolhead")["position"]


@pytest.mark.parametrize("restart", ["gcode/firmware_restart", "gcode/restart"])
@pytest.mark.parametrize("seconds", [20., 60., 75.])
def test_cable_cut_while_printing(make_host, tmp_path, job, seconds, restart):
    host = make_host(make_config(tmp_path))
    mcu = host.machine.mcus["mcu"]

    def lose_the_cable(host):
        start_print(host, job)
        host.pause(seconds)
        assert host.status("print_stats")["state"] == "printing"
        if seconds == 20.:
            assert find_heater(host, "extruder").duty > 0.
        mcu.link.cut()
        cut_at = host.reactor.monotonic()
        message = wait_for_state(host, "shutdown", 30.)
        assert "Lost communication with MCU 'mcu'" in message
        assert "FIRMWARE_RESTART" in message
        # the heater's max_duration of 3 s and the way of the last command
        host.pause(max(0., cut_at + 6. - host.reactor.monotonic()))
        check_safe(host)
        mcu.link.restore()

    def print_again(host):
        assert host.info()["state"] == "ready", host.info()
        assert print_to_the_end(host, job)[:2] == [119., 113.]

    host.run_boots(lose_the_cable, print_again, restart=restart)


def check_safe(host):
    """Nothing heats or moves, whatever time passes; the daemon answers."""
    steps = host.machine.get_total_steps()
    for _ in range(20):
        host.pause(0.5)
        assert all(h.duty == 0. for h in host.machine.thermal.heaters)
    assert host.machine.get_total_steps() == steps
    assert host.info()["state"] == "shutdown"


def test_cable_of_the_second_mcu(make_host, tmp_path, job):
    """The first one is stopped at once and told who failed."""
    host = make_host(make_two_mcus() + "\n[virtual_sdcard]\npath: %s\n" % tmp_path)

    def lose_a_cable(host):
        host.script("M140 S60")
        start_print(host, job)
        host.pause(20.)
        assert find_heater(host, "heater_bed").duty > 0.
        host.machine.mcus["tool"].link.cut()
        assert "Lost communication with MCU 'tool'" in wait_for_state(
            host, "shutdown", 30.)
        host.pause(0.5)
        check_safe(host)
        host.machine.mcus["tool"].link.restore()

    def print_again(host):
        assert print_to_the_end(host, job)[:2] == [119., 113.]

    host.run_boots(lose_a_cable, print_again, restart="gcode/firmware_restart")


def test_restart_before_the_repair(make_host, tmp_path, job):
    """The cable is still out: an error, and the next restart helps."""
    host = make_host(make_config(tmp_path))
    link = host.machine.mcus["mcu"].link

    def lose_the_cable(host):
        start_print(host, job)
        host.pause(20.)
        link.cut()
        wait_for_state(host, "shutdown", 30.)

    def find_it_silent(host):
        message = wait_for_state(host, "error")
        assert "'mcu'" in message and "FIRMWARE_RESTART" in message
        link.restore()

    def print_again(host):
        assert print_to_the_end(host, job)[:2] == [119., 113.]

    host.run_boots(lose_the_cable, find_it_silent, print_again,
                   restart="gcode/firmware_restart")


def test_silent_mcu(make_host, tmp_path, job):
    host = make_host(make_config(tmp_path))
    host.machine.mcus["mcu"].link.cut()

    def find_it_silent(host):
        message = wait_for_state(host, "error")
        assert "'mcu'" in message and "connect" in message
        assert "FIRMWARE_RESTART" in message or "RESTART" in message
        host.machine.mcus["mcu"].link.restore()

    def find_it_there(host):
        assert host.info()["state"] == "ready"
        print_to_the_end(host, job)

    host.run_boots(find_it_silent, find_it_there)


def test_no_such_port(make_host, tmp_path):
    """Without a simulated machine: the port of the config does not exist."""
    port = tmp_path / "ttyNone"
    host = make_host(make_config(tmp_path).replace("/dev/null", str(port)))
    machine, host.machine = host.machine, None

    def find_no_port(host):
        message = wait_for_state(host, "error")
        assert "'mcu'" in message and str(port) in message
        host.start_args["machine"] = machine

    host.run_boots(find_no_port, lambda host: wait_for_state(host, "ready"))


class Terminal:
    """A pseudo terminal with something else than an mcu behind it."""

    def __init__(self, talk=None):
        """talk(fd): body of a thread at the other end."""
        self.other, self.end = pty.openpty()
        tty.setraw(self.end)
        self.path = os.ttyname(self.end)
        self.thread = threading.Thread(
            target=talk or (lambda fd: None), args=(self.other,), daemon=True)
        self.thread.start()

    def close(self):
        os.close(self.end)
        os.close(self.other)


def echo(fd):
    """Send all back, as a looped cable does."""
    try:
        while True:
            os.write(fd, os.read(fd, 4096))
    except OSError:
        return


def babble(fd):
    """Send what is no protocol, as another device does."""
    rng = random.Random(1)
    try:
        for _ in range(100):
            os.write(fd, rng.randbytes(100))
            os.read(fd, 4096)
    except OSError:
        return


@pytest.mark.parametrize("talk", [None, echo, babble])
def test_port_without_an_mcu(talk, monkeypatch):
    """A real port, in real time, with shorter limits."""
    monkeypatch.setattr(serialhdl, "CONNECT_TIMEOUT", 0.3)
    monkeypatch.setattr(serialhdl, "IDENTIFY_TIMEOUT", 0.2)
    monkeypatch.setattr(serialhdl, "OPEN_INTERVAL", 0.2)
    terminal = Terminal(talk)
    reactor = Reactor(RealClock())
    reader = serialhdl.SerialReader(reactor, "tool")
    errors = []

    def connect(eventtime):
        try:
            reader.connect_pipe(terminal.path)
        except McuError as err:
            errors.append(str(err))
        reactor.end()

    reactor.register_callback(connect)
    reactor.run()
    reader.disconnect()
    terminal.close()
    reactor.finalize()
    (message,) = errors
    assert "mcu 'tool'" in message and terminal.path in message
    assert "no answer" in message


@pytest.fixture(scope="module")
def quiet_print(tmp_path_factory):
    """Steps of the job without noise: {stepper: (net, in both directions)}."""
    folder = tmp_path_factory.mktemp("quiet")
    (folder / "job.gcode").write_text(JOB)
    found = {}
    host = Host(folder, make_config(folder))
    host.run_boots(lambda host: found.update(print_and_count(host, "job.gcode")))
    return found


def print_and_count(host, name):
    """Steps of a print: {stepper: (net, in both directions)}."""
    host.script("G28\nM400")       # ends where the switch is, to a step
    machine = host.machine
    # the print homes again: from there on it does not depend on the first time
    host.script("G1 Z5 F600\nM400")
    net, total = machine.get_step_counts(), machine.get_total_steps()
    assert print_to_the_end(host, name) == pytest.approx([119., 113., 5., 44.])
    return {stepper: (count - net[stepper],
                      machine.get_total_steps()[stepper] - total[stepper])
            for stepper, count in machine.get_step_counts().items()}


@pytest.mark.parametrize("rate", [1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("kind", ["flip", "drop", "insert", "double"])
def test_noise(make_host, tmp_path, job, quiet_print, kind, rate):
    """No step more, no step less."""
    host = make_host(make_config(tmp_path))
    mcu = host.machine.mcus["mcu"]
    mcu.link.set_faults(**{kind: rate})

    def print_in_noise(host):
        assert print_and_count(host, job) == quiet_print
        assert host.info()["state"] == "ready"
        host.pause(2.)
        stats = host.status("mcu")["last_stats"]
        if rate >= 1e-4:
            assert stats["bytes_retransmit"] + stats["bytes_invalid"] > 0

    host.run_boots(print_in_noise)


# Boards with other firmware

def build(folder, *options):
    """The simulator's firmware with other options; path of the object."""
    config = folder / "other.config"
    config.write_text((ROOT / "test/configs/simulator.config").read_text()
                      + "".join(option + "\n" for option in options))
    subprocess.run(
        ["make", "firmware", "OUT=%s/" % (folder / "out",),
         "KCONFIG_CONFIG=%s" % (config,), "PYTHON=" + sys.executable],
        cwd=ROOT, check=True, capture_output=True)
    return folder / "out" / "klipper.so"


@pytest.fixture(scope="module")
def firmware(tmp_path_factory):
    return build(tmp_path_factory.mktemp("firmware"))


def find_dictionary(data):
    """(start, end) of the compressed dictionary in a firmware's file."""
    for match in re.finditer(rb"\x78[\x01\x5e\x9c\xda]", data):
        unpacker = zlib.decompressobj()
        try:
            text = unpacker.decompress(data[match.start():])
            if b'"commands"' in text and json.loads(text):
                return match.start(), len(data) - len(unpacker.unused_data)
        except (zlib.error, ValueError):
            continue
    raise AssertionError("no dictionary in the firmware")


def other_host(make_host, tmp_path, library):
    return make_host(make_config(tmp_path) + "\n[simulator]\nfirmware: %s\n"
                     % (library,))


def expect_error(host, *texts):
    def look(host):
        message = wait_for_state(host, "error")
        for text in texts:
            assert text in message, message
    host.run_boots(look)


def replace_dictionary(firmware, folder, change):
    """A firmware with change(dictionary) (JSON) as its dictionary."""
    data = bytearray(firmware.read_bytes())
    start, end = find_dictionary(data)
    content = json.loads(zlib.decompress(data[start:end]))
    text = json.dumps(change(content), separators=(",", ":"))
    packed = zlib.compress(text.encode(), 9)
    assert len(packed) <= end - start
    data[start:end] = packed.ljust(end - start, b"\0")
    library = folder / "changed.so"
    library.write_bytes(data)
    return library


@pytest.mark.parametrize("damage", ["byte", "text", "end", "all"])
def test_damaged_dictionary(make_host, tmp_path, firmware, damage):
    data = bytearray(firmware.read_bytes())
    start, end = find_dictionary(data)
    middle = (start + end) // 2
    if damage == "byte":
        data[middle] ^= 0x55
    elif damage == "text":
        data[start:end] = zlib.compress(b"no dictionary", 0).ljust(
            end - start, b"\0")
    else:
        first = middle if damage == "end" else start
        data[first:end] = bytes(end - first)
    library = tmp_path / "damaged.so"
    library.write_bytes(data)
    expect_error(other_host(make_host, tmp_path, library), "'mcu'", "dictionary")


@pytest.mark.parametrize("change", [
    lambda content: ["a list"], lambda content: {"version": "only"},
    lambda content: dict(content, commands={"identify": "one"}),
    lambda content: dict(content, commands={"": 1}),
    lambda content: dict(content, enumerations=["pin"]),
    lambda content: dict(content, enumerations={"pin": {"PA0": [1, 2, 3]}}),
    lambda content: dict(content, enumerations={"pin": {"PA0": ["x", 2]}})])
def test_odd_dictionary(make_host, tmp_path, firmware, change):
    library = replace_dictionary(firmware, tmp_path, change)
    expect_error(other_host(make_host, tmp_path, library), "'mcu'", "dictionary")


def test_no_stepper_commands(make_host, tmp_path, firmware):
    def change(content):
        content["commands"] = {text: number for text, number
                               in content["commands"].items() if "step" not in text}
        return content
    library = replace_dictionary(firmware, tmp_path, change)
    expect_error(other_host(make_host, tmp_path, library), "'mcu'", "step",
                 "build the firmware of this version")


def test_other_version(make_host, tmp_path, firmware, job, all_logs):
    """It is told, and prints: the commands are what counts."""
    library = replace_dictionary(
        firmware, tmp_path, lambda content: dict(content, version="v0.0.1-x"))
    host = other_host(make_host, tmp_path, library)
    host.run_boots(lambda host: print_to_the_end(host, job))
    assert any("'mcu' runs firmware v0.0.1-x" in r.getMessage()
               for r in all_logs.records)


def test_config_differs_from_that_of_the_board(make_host, tmp_path, job, all_logs):
    """RESTART with a changed config restarts the board by itself."""
    host = make_host(make_config(tmp_path))

    def change(host):
        assert host.info()["state"] == "ready"
        with host.config_path.open("a") as file:
            file.write("\n[output_pin light]\npin: gpio60\n")

    def use(host):
        host.script("SET_PIN PIN=light VALUE=1")
        print_to_the_end(host, job)
        assert host.status("output_pin light")["value"] == 1.

    host.run_boots(change, use)
    assert host.boots == 3
    assert not [r for r in all_logs.records if "shuts down" in r.getMessage()]


def test_firmware_lacks_a_command(make_host, tmp_path):
    library = build(tmp_path, "CONFIG_WANT_ADC=n")
    expect_error(other_host(make_host, tmp_path, library), "'mcu'", "analog_in",
                 "firmware")


def test_board_that_forgot(make_host, tmp_path, job):
    """Power fails for a moment: the board comes back without its configuration."""
    host = make_host(make_config(tmp_path))
    mcu = host.machine.mcus["mcu"]

    def fail(host):
        start_print(host, job)
        host.pause(30.)
        mcu.reset()
        message = wait_for_state(host, "shutdown", 30.)
        assert "'mcu'" in message

    host.run_boots(fail, lambda host: print_to_the_end(host, job),
                   restart="gcode/firmware_restart")


def test_quiet_start(make_host, tmp_path, all_logs):
    """What a board says before its dictionary is read is no warning.

    With RESTART it still reports temperatures from before.
    """
    make_host(make_config(tmp_path)).run_boots(
        lambda host: host.pause(2.), lambda host: host.pause(2.))
    unknown = [r for r in all_logs.records if "unknown message" in r.getMessage()]
    assert unknown and all(r.levelno == logging.DEBUG for r in unknown)


def test_a_reset_that_was_lost_is_tried_again(make_host, tmp_path, monkeypatch):
    """The board was said to be restarted, but still is shut down."""
    runs, run = [], McuRestart.run

    def lose_first(restart):
        runs.append(restart)
        if len(runs) == 1:
            restart._mcu.close_link()
        else:
            run(restart)

    monkeypatch.setattr(McuRestart, "run", lose_first)
    host = make_host(make_config(tmp_path))

    def stop(host):
        host.client.send("emergency_stop")
        wait_for_state(host, "shutdown", 5.)

    def follow(host):
        if host.info()["state"] != "ready":
            host.pause(5.)      # it restarts by itself
        assert host.info()["state"] == "ready", host.info()
        assert len(runs) == 2

    host.run_boots(stop, follow, restart="gcode/firmware_restart")
