# SPDX-License-Identifier: GPL-3.0-or-later
"""The linux firmware and this computer's devices: what it says to the kernel.

gpio, spi and i2c through a C program that stands for the kernel at its ioctl()s;
pwm, analog inputs and watchdog on folders that look like sysfs and /dev.
"""

import os
import struct
import subprocess

import pytest
from linux_board import (
    FREQ,
    ROOT,
    LinuxHost,
    LinuxProcess,
    wait_for,
)

PWM = "sys/class/pwm/pwmchip2"
IIO = "sys/bus/iio/devices/iio:device0"


def test_gpio_spi_and_i2c(linux_elf, tmp_path):
    """test/firmware/linux_devices.c, under the sanitizers."""
    out, program = linux_elf.parent, tmp_path / "linux_devices"
    flags = ["-std=gnu11", "-D_GNU_SOURCE", "-g", "-Wall", "-Wextra", "-Wshadow",
             "-Werror", "-Isrc", "-Isrc/linux", "-I%s" % out, "-include",
             str(out / "autoconf.h"), "-fsanitize=address,undefined",
             "-fno-sanitize-recover=all"]
    objects = []
    for name in ("gpio", "gpio_chardev", "spi", "spi_dev", "i2c", "i2c_dev"):
        objects.append(str(tmp_path / name) + ".o")
        source = "src/linux/%s.c" % name
        header = out / "decl" / source.replace(".c", ".h")
        subprocess.run(["gcc", *flags, "-include", str(header), "-c", source,
                        "-o", objects[-1]], cwd=ROOT, check=True)
    subprocess.run(
        ["gcc", *flags, "test/firmware/linux_devices.c", *objects, "-o", program,
         "-Wl,--wrap=ioctl,--wrap=open,--wrap=close"], cwd=ROOT, check=True)
    result = subprocess.run([program], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "11 tests passed" in result.stdout


class Computer:
    """The firmware on a folder that holds dev and sys."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.run = self.host = None

    def write(self, path, text=""):
        path = self.folder / path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def read(self, path):
        return (self.folder / path).read_text()

    def start(self, *options):
        self.run = LinuxProcess(self.program, self.folder, "--root",
                                str(self.folder), *options, fake=False)
        assert self.run.process.poll() is None, self.run.read_errors()
        self.host = LinuxHost(self.run.link)
        self.host.identify()
        return self.host

    def stop(self):
        if self.host:
            self.host.close()
        if self.run:
            self.run.stop()


@pytest.fixture
def computer(linux_elf, tmp_path):
    computer = Computer(linux_elf, tmp_path)
    yield computer
    computer.stop()


def config_pwm(host, name="pwmchip2/pwm3"):
    host.send("allocate_oids", count=1)
    host.send("config_pwm_out", oid=0, pin=host.find_pin(name),
              cycle_ticks=FREQ // 100, value=16384, default_value=0,
              max_duration=0)


def write_pwm_channel(computer):
    for name in ("period", "duty_cycle", "enable"):
        computer.write("%s/pwm3/%s" % (PWM, name))


def test_pwm_in_sysfs(computer):
    write_pwm_channel(computer)
    host = computer.start()
    config_pwm(host)
    assert computer.read(PWM + "/pwm3/period") == "10000000"
    assert computer.read(PWM + "/pwm3/duty_cycle").rstrip("\0") == "5000000"
    assert computer.read(PWM + "/pwm3/enable") == "1"
    host.send("finalize_config", crc=1)
    host.send("queue_pwm_out", oid=0, clock=host.get_clock() + FREQ // 2,
              value=32768)
    host.wait(lambda: computer.read(PWM + "/pwm3/duty_cycle") == "10000000")


def test_pwm_channel_is_exported(computer):
    """It has no files until the system has made them of the export."""
    computer.write(PWM + "/export")
    host = computer.start()
    config_pwm(host)
    assert host.wait_shutdown() == "Not a valid PWM pin"
    assert computer.read(PWM + "/export") == "3"
    write_pwm_channel(computer)
    n = len(host.messages)
    host.send_only("reset")
    host.wait_message("starting", n)
    host.seq = 0
    config_pwm(host)
    assert computer.read(PWM + "/pwm3/enable") == "1"


def test_absent_pwm_channel(computer):
    host = computer.start()
    config_pwm(host)
    assert host.wait_shutdown() == "Not a valid PWM pin"
    assert "pwmchip2/pwm3 cannot be had" in computer.run.read_errors()


def query_analog(host, max_value=0xFFFF):
    host.configure(("config_analog_in", dict(
        oid=0, pin=host.find_pin("analog1"))))
    host.send("query_analog_in", oid=0, clock=host.get_clock() + FREQ // 2,
              sample_ticks=50000, sample_count=2, rest_ticks=FREQ // 50,
              bytes_per_report=2, min_value=0, max_value=max_value,
              range_check_count=1)


def read_analog(host):
    return struct.unpack("<H", host.list_messages(
        "analog_in_state")[-1]["values"])[0]


@pytest.mark.parametrize("options, raw, reading", [
    ((), 1000, 1000), ((), 5000, 4095), (("--adc-bits", "16"), 40000, 2500),
    (("--adc-bits", "10"), 1000, 4000)])
def test_analog_input_in_sysfs(computer, options, raw, reading):
    computer.write(IIO + "/in_voltage1_raw", "%d\n" % raw)
    host = computer.start("--max-late", "10000", *options)
    query_analog(host)
    host.wait_message("analog_in_state")
    assert read_analog(host) == 2 * reading
    computer.write(IIO + "/in_voltage1_raw", "0\n")
    host.wait(lambda: read_analog(host) == 0)


def test_analog_input_that_fails(computer):
    computer.write(IIO + "/in_voltage1_raw", "5\n")
    host = computer.start("--max-late", "10000")
    query_analog(host)
    host.wait_message("analog_in_state")
    os.truncate(computer.folder / IIO / "in_voltage1_raw", 0)
    assert host.wait_shutdown() == "Analog input cannot be read"


def test_absent_analog_input(computer):
    host = computer.start()
    host.send("allocate_oids", count=1)
    host.send("config_analog_in", oid=0, pin=host.find_pin("analog1"))
    assert host.wait_shutdown() == "Not a valid ADC pin"
    assert "in_voltage1_raw" in computer.run.read_errors()


def test_absent_gpio_chip(computer):
    host = computer.start()
    host.send("set_digital_out", pin=host.find_pin("gpio5"), value=1)
    assert host.wait_shutdown() == "Not an output pin"
    assert "dev/gpiochip0 cannot be opened" in computer.run.read_errors()


def test_watchdog(computer):
    computer.write("dev/watchdog")
    host = computer.start("-w")
    wait_for(lambda: computer.read("dev/watchdog").startswith("."))
    host.get_clock()
    computer.run.stop()
    assert computer.read("dev/watchdog").endswith("V")


@pytest.mark.parametrize("options, error", [
    (("-w",), "dev/watchdog cannot be opened"),
    (("--fake", "absent"), "absent/board cannot be mapped"),
    (("--max-late", "soon"), "--max-late soon: must be a number from 1"),
    (("extra",), "What is extra?"),
])
def test_options_that_cannot_be(linux_elf, tmp_path, options, error):
    result = subprocess.run(
        [linux_elf, "-I", tmp_path / "link", "--root", tmp_path, *options],
        cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert result.returncode in (1, 2)
    assert error in result.stderr
    assert not os.path.lexists(tmp_path / "link")


def test_help(linux_elf):
    result = subprocess.run([linux_elf, "--help"], capture_output=True, text=True)
    assert result.returncode == 0 and "-I PATH" in result.stdout


def test_link_that_is_a_file(linux_elf, tmp_path):
    link = tmp_path / "link"
    link.write_text("precious")
    result = subprocess.run([linux_elf, "-I", link], capture_output=True,
                            text=True, timeout=300)
    assert result.returncode == 1 and "is in the way" in result.stderr
    assert link.read_text() == "precious"


@pytest.mark.parametrize("rules, error", [
    ("stepper x gpio1", "line 1: must be: stepper NAME"),
    ("\nstepper x gpio1 PA2", "line 2: a pin is gpio<line>"),
    ("stepper x gpio1 gpio512", "there is no such pin"),
    ("switch gpio1 1 below 0 x 1", "a switch names a stepper"),
    ("lever gpio1", "a rule is a stepper or a switch")])
def test_rules_that_cannot_be(linux_elf, tmp_path, rules, error):
    (tmp_path / "rules").write_text(rules + "\n")
    result = subprocess.run([linux_elf, "-I", tmp_path / "link", "--fake", tmp_path],
                            capture_output=True, text=True, timeout=300)
    assert result.returncode == 1 and error in result.stderr


def test_real_time_that_is_not_permitted(linux_elf, tmp_path):
    """As an unprivileged user, whatever the tests run as."""
    tmp_path.chmod(0o777)
    for folder in tmp_path.parents[:2]:
        folder.chmod(0o755)
    elf = tmp_path / "klipper.elf"
    elf.write_bytes(linux_elf.read_bytes())
    elf.chmod(0o755)
    command = [str(elf), "-r", "-I", str(tmp_path / "link")]
    if os.geteuid() == 0:
        command = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups",
                   "--no-new-privs", "--inh-caps=-all", *command]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 1, result.stderr
    assert "not permitted" in result.stderr and "setcap" in result.stderr
