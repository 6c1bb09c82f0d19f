# SPDX-License-Identifier: GPL-3.0-or-later
"""Links and boards that fail: one clear cause is told, the machine ends in a safe
state, the daemon stays up, and a restart after the repair prints again."""

import json
import pathlib
import re
import subprocess
import sys
import zlib

import pytest
from machine_configs import BED, make_axes

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONFIG = make_axes("cartesian", extra=BED + "\n[virtual_sdcard]\npath: %s\n")
JOB = "G28\nM109 S200\nG90\nM83\nG1 X100 Y100 Z5 F6000\n" + "".join(
    "G1 X%d E0.02 F3000\nG1 Y%d E0.2\n" % (80 + i % 40, 80 + i * 7 % 40)
    for i in range(200)) + "M400\nM104 S0\n"
CONNECT_LIMIT = 200.            # s until the daemon gives up on a silent mcu


def make_config(folder):
    return CONFIG % (folder,)


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


@pytest.mark.parametrize("seconds", [20., 60., 75.])
def test_cable_cut_while_printing(make_host, tmp_path, job, seconds):
    host = make_host(make_config(tmp_path))
    mcu = host.machine.mcus["mcu"]

    def lose_the_cable(host):
        start_print(host, job)
        host.pause(seconds)
        assert host.status("print_stats")["state"] == "printing"
        mcu.link.cut()
        cut_at = host.reactor.monotonic()
        message = wait_for_state(host, "shutdown", 30.)
        assert "Lost communication with MCU 'mcu'" in message
        assert "FIRMWARE_RESTART" in message
        # the heater's max_duration of 3 s and the way of the last command
        host.pause(max(0., cut_at + 6. - host.reactor.monotonic()))
        assert find_heater(host, "extruder").duty == 0.
        assert host.info()["state"] == "shutdown"
        mcu.link.restore()

    def print_again(host):
        assert host.info()["state"] == "ready", host.info()
        assert print_to_the_end(host, job)[:2] == [119., 113.]

    host.run_boots(lose_the_cable, print_again, restart="gcode/firmware_restart")


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


@pytest.mark.parametrize("rate", [1e-5, 1e-4])
@pytest.mark.parametrize("kind", ["flip", "drop", "insert", "double"])
def test_noise(make_host, tmp_path, job, kind, rate):
    host = make_host(make_config(tmp_path))
    mcu = host.machine.mcus["mcu"]
    mcu.link.set_faults(**{kind: rate})

    def print_in_noise(host):
        assert print_to_the_end(host, job) == pytest.approx([119., 113., 5., 44.])
        assert host.info()["state"] == "ready"
        assert host.machine.calc_position() == pytest.approx((119., 113., 5.),
                                                             abs=0.013)

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


@pytest.mark.parametrize("damage", ["byte", "text"])
def test_damaged_dictionary(make_host, tmp_path, firmware, damage):
    data = bytearray(firmware.read_bytes())
    start, end = find_dictionary(data)
    if damage == "byte":
        data[(start + end) // 2] ^= 0x55
    else:
        data[start:end] = zlib.compress(b"no dictionary", 0).ljust(
            end - start, b"\0")
    library = tmp_path / "damaged.so"
    library.write_bytes(data)
    expect_error(other_host(make_host, tmp_path, library), "'mcu'", "dictionary")


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


def test_quiet_start(make_host, tmp_path, caplog):
    """What a board says before its dictionary is read is no warning."""
    make_host(make_config(tmp_path)).run_boots(lambda host: host.pause(1.))
    assert not [r for r in caplog.records if "unknown message" in r.message]
