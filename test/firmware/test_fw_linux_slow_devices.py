# SPDX-License-Identifier: GPL-3.0-or-later
"""The linux firmware's devices that take their time: DS18B20 and PCA9685.

The first are files that look like the kernel's; what goes to the second is noted
by a library that is loaded before the firmware (linux_preload.c).
"""

import subprocess

import pytest
from linux_board import FREQ, ROOT
from test_fw_linux_devices import Computer

SERIAL = "28-0316a2794dff"
FILE = "sys/bus/w1/devices/%s/w1_slave"
REST = FREQ // 5
RELAXED = ("--max-late", "10000")


@pytest.fixture(scope="session")
def preload(tmp_path_factory):
    """The library of linux_preload.c."""
    library = tmp_path_factory.mktemp("preload") / "preload.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-Wall", "-Werror", "-o", library,
                    "test/firmware/linux_preload.c"], cwd=ROOT, check=True)
    return library


@pytest.fixture
def computer(linux_elf, preload, tmp_path, monkeypatch):
    monkeypatch.setenv("LD_PRELOAD", str(preload))
    # of a build with sanitizers, whose library wants to be the first
    monkeypatch.setenv("ASAN_OPTIONS", "verify_asan_link_order=0")
    monkeypatch.setenv("I2C_LOG", str(tmp_path / "i2c"))
    monkeypatch.setenv("SLOW_READS", str(tmp_path / "slow"))
    computer = Computer(linux_elf, tmp_path)
    yield computer
    computer.stop()


# DS18B20


def show(computer, celsius, crc="YES", serial=SERIAL):
    """What the kernel shows of a thermometer."""
    computer.write(FILE % (serial,), "4b 46 7f ff 05 10 e1 : crc=e1 %s\n"
                   "4b 46 7f ff 05 10 e1 t=%d\n" % (crc, celsius * 1000))


def configure(host, serial=SERIAL, max_errors=3):
    host.configure(("config_ds18b20", dict(
        oid=1, serial=serial.encode(), max_error_count=max_errors)))


def query(host, low=-10., high=100.):
    """Ask five times a second from now on; returns the first clock."""
    clock = (host.get_clock() + FREQ // 10) % 2**32
    host.send("query_ds18b20", oid=1, clock=clock, rest_ticks=REST,
              min_value=int(low * 1000) % 2**32, max_value=int(high * 1000))
    return clock


def wait_results(host, count, start=0):
    host.wait(lambda: len(host.list_messages("ds18b20_result", start)) >= count)
    return host.list_messages("ds18b20_result", start)


@pytest.mark.parametrize("celsius", [20.687, -7.5, 0.])
def test_readings_come_regularly(computer, celsius):
    show(computer, celsius)
    host = computer.start(*RELAXED)
    configure(host)
    clock = query(host)
    for i, result in enumerate(wait_results(host, 3)[:3]):
        assert result["next_clock"] == (clock + (i + 1) * REST) % 2**32
        assert result["value"] in (celsius * 1000, celsius * 1000 + 2**32)
        assert result["fault"] == 0
    n = len(host.messages)
    show(computer, 33.25)
    host.wait(lambda: any(r["value"] == 33250
                          for r in host.list_messages("ds18b20_result", n)))
    host.send("query_ds18b20", oid=1, clock=0, rest_ticks=0, min_value=0, max_value=0)
    n = len(host.messages)
    for _ in range(50):
        host.pump(0.02)
    assert not host.list_messages("ds18b20_result", n)


def test_two_thermometers(computer):
    show(computer, 20.)
    show(computer, 50., serial="28-1")
    host = computer.start(*RELAXED)
    host.configure(*[("config_ds18b20", dict(oid=oid, serial=serial.encode(),
                                             max_error_count=3))
                     for oid, serial in ((1, SERIAL), (2, "28-1"))])
    clock = (host.get_clock() + FREQ // 10) % 2**32
    for oid in (1, 2):
        host.send("query_ds18b20", oid=oid, clock=clock, rest_ticks=REST,
                  min_value=0, max_value=90000)
    results = wait_results(host, 6)
    assert {(r["oid"], r["value"]) for r in results} == {(1, 20000), (2, 50000)}


@pytest.mark.parametrize("text, fault", [
    ("4b : crc=e1 NO\n4b t=20000\n", 5), ("", 5), ("YES YES", 5)])
def test_faults_in_a_row_are_too_many(computer, text, fault):
    show(computer, 20.)
    host = computer.start(*RELAXED)
    configure(host)
    query(host)
    wait_results(host, 1)
    computer.write(FILE % (SERIAL,), text)
    assert host.wait_shutdown() == "Error reading DS18B20 sensor"
    faults = [r["fault"] for r in host.list_messages("ds18b20_result")]
    assert faults[-3:] == [fault] * 3 and 0 in faults


def test_one_odd_reading_is_no_fault(computer):
    """85 degC is what such a thermometer says after it lost its power."""
    show(computer, 20.)
    host = computer.start(*RELAXED)
    configure(host, max_errors=5)
    query(host, high=80.)
    wait_results(host, 1)
    show(computer, 85.)
    n = len(host.messages)
    host.wait(lambda: any(r["value"] == 85000
                          for r in host.list_messages("ds18b20_result", n)))
    show(computer, 20.)
    wait_results(host, 10, len(host.messages))
    assert not host.list_messages("shutdown")


def test_out_of_range(computer):
    show(computer, 20.)
    host = computer.start(*RELAXED)
    configure(host)
    query(host, high=80.)
    wait_results(host, 1)
    show(computer, 90.)
    assert host.wait_shutdown() == "DS18B20 out of range"


def test_thermometer_that_takes_too_long(computer):
    show(computer, 20.)
    host = computer.start(*RELAXED)
    configure(host)
    query(host)
    wait_results(host, 1)
    computer.write("slow")
    assert host.wait_shutdown() == "DS18B20 sensor didn't respond in time"


@pytest.mark.parametrize("serial, reason", [
    ("28/1", "Invalid DS18B20 serial id, must not contain '/'"),
    ("", "Invalid DS18B20 serial id, must not contain '/'"),
    ("28-" + 40 * "0", "Invalid DS18B20 serial id, must not contain '/'"),
    ("28-2", "Invalid DS18B20 serial id, could not open for reading")])
def test_absent_thermometer(computer, serial, reason):
    host = computer.start()
    host.send("allocate_oids", count=2)
    host.send("config_ds18b20", oid=1, serial=serial.encode(), max_error_count=1)
    assert host.wait_shutdown() == reason
    if "open" in reason:
        assert "w1-therm" in computer.run.read_errors()


# PCA9685: mode, pre-scale, channel registers of the data sheet

CYCLE = FREQ // 1000
AWAKE = ["40 0030", "40 fe05", "40 0020", "40 0104"]


def list_writes(computer):
    return computer.read("i2c").split("\n")[:-1]


def start_pca9685(computer, **values):
    """A chip at address 0x40 of bus 1 with channel 2."""
    computer.write("dev/i2c-1")
    host = computer.start(*RELAXED)
    host.configure(("config_pca9685", {
        **dict(oid=1, bus=1, addr=0x40, channel=2, cycle_ticks=CYCLE, value=1024,
               default_value=0, max_duration=0), **values}))
    return host


def test_pca9685_starts_with_its_value(computer):
    host = start_pca9685(computer)
    assert list_writes(computer) == [*AWAKE, "40 0e00000004"]
    assert host.dictionary["config"]["PCA9685_MAX"] == 4096


@pytest.mark.parametrize("value, data", [
    (0, "00000010"), (1, "00000100"), (4095, "0000ff0f"), (4096, "00100000")])
def test_pca9685_changes_at_its_clock(computer, value, data):
    host = start_pca9685(computer)
    clock = host.get_clock() + FREQ // 5
    host.send("queue_pca9685_out", oid=1, clock=clock % 2**32, value=value)
    host.wait(lambda: len(list_writes(computer)) > 5)
    assert (host.get_clock() - clock) % 2**32 < 2**31
    assert list_writes(computer)[5:] == ["40 0e" + data]


def test_pca9685_shutdown_brings_the_default(computer):
    host = start_pca9685(computer, default_value=2048)
    host.send("emergency_stop")
    assert host.wait_shutdown() == "Command request"
    host.wait(lambda: list_writes(computer)[-1] == "40 0e00000008")


def test_pca9685_max_duration(computer):
    host = start_pca9685(computer, max_duration=FREQ // 4)
    assert host.wait_shutdown() == "Missed scheduling of next pca9685 event"
    host.wait(lambda: list_writes(computer)[-1] == "40 0e00000010")


def test_pca9685_value_beyond_max_duration(computer):
    host = start_pca9685(computer, max_duration=FREQ)
    host.send("queue_pca9685_out", oid=1, value=5,
              clock=(host.get_clock() + 3 * FREQ) % 2**32)
    assert host.wait_shutdown() == "Scheduled pca9685 event will exceed max_duration"


def test_pca9685_without_an_object(computer):
    host = start_pca9685(computer)
    host.send("set_pca9685_out", bus=1, addr=0x40, channel=15, cycle_ticks=CYCLE,
              value=4096)
    assert list_writes(computer)[5:] == ["40 4200100000"]
    host.send("set_pca9685_out", bus=1, addr=0x41, channel=0, cycle_ticks=FREQ // 50,
              value=0)
    assert list_writes(computer)[6:] == [
        "41 0030", "41 fe79", "41 0020", "41 0104", "41 0600000010"]


@pytest.mark.parametrize("values, reason", [
    (dict(channel=16), "Invalid pca9685 channel or value"),
    (dict(value=4097), "Invalid pca9685 channel or value"),
    (dict(cycle_ticks=CYCLE + 1),
     "All PCA9685 channels must have the same cycle_ticks"),
    (dict(addr=0x42, cycle_ticks=0), "Unable to open and init PCA9685 device"),
    (dict(bus=9), "Unsupported i2c bus")])
def test_pca9685_that_cannot_be(computer, values, reason):
    host = start_pca9685(computer)
    host.send("set_pca9685_out", **{
        **dict(bus=1, addr=0x40, channel=0, cycle_ticks=CYCLE, value=0), **values})
    assert host.wait_shutdown() == reason


@pytest.mark.parametrize("command, values, reason", [
    ("set_pca9685_out", dict(bus=1, addr=0x41, channel=0, cycle_ticks=CYCLE, value=0),
     "Unable to open and init PCA9685 device"),
    ("set_pca9685_out", dict(bus=1, addr=0x40, channel=0, cycle_ticks=CYCLE, value=0),
     "Unable to update PCA9685 value"),
    ("queue_pca9685_out", dict(oid=1, clock=0, value=5),
     "Unable to update PCA9685 value"),
    ("queue_pca9685_out", dict(oid=1, clock=0, value=4097), "Invalid pca9685 value")])
def test_pca9685_that_answers_no_longer(computer, command, values, reason):
    host = start_pca9685(computer)
    computer.write("i2c.fail")
    if "clock" in values:
        values = dict(values, clock=(host.get_clock() + FREQ // 5) % 2**32)
    host.send(command, **values)
    assert host.wait_shutdown() == reason
