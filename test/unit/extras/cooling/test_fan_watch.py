# SPDX-License-Identifier: GPL-3.0-or-later
"""Fans that should turn and stand still, on the simulated machine."""
from fan_rotor import Rotor
from outputs_bench import OutputsBench

VENT = """
[fan_generic vent]
pin: %s
tachometer_pin: ^%s
"""
AUX = "[mcu aux]\nserial: /dev/null\nis_non_critical: True\n"
HOTEND = """
[heater_fan hotend]
pin: PA1
tachometer_pin: ^PA2
heater: block
[heater_generic block]
heater_pin: PB4
sensor_type: ATC Semitec 104GT-2
sensor_pin: PK5
control: watermark
min_temp: 0
max_temp: 260
"""


def make(tmp_path, monkeypatch, pin="PA1", tachometer="PA2", extra=""):
    """A bench with [fan_generic vent], and what turns in it."""
    bench = OutputsBench(tmp_path, monkeypatch, extra + VENT % (pin, tachometer))
    return bench, Rotor(bench, tachometer, 2)


def count_told(bench, section="fan_generic vent"):
    """Number of warnings so far; each names the section and what to look at."""
    lines = [line for line in bench.output if "stands still" in line]
    for line in lines:
        assert line.startswith("// Warning: the fan of section '%s'" % (section,))
        assert "check the fan" in line and "!!" not in line
    return len(lines)


def set_speed(bench, speed):
    bench.send("SET_FAN_SPEED FAN=vent SPEED=%s" % (speed,))


def test_stuck_fan_is_told_once(tmp_path, monkeypatch):
    bench, rotor = make(tmp_path, monkeypatch)

    def body(it):
        it.pause(3.0)
        set_speed(it, 0.5)
        it.pause(4.5)
        assert count_told(it) == 0
        it.pause(4.0)
        assert count_told(it) == 1
        assert "(power 0.50)" in it.output[-1]
        it.pause(20.0)
        # off and on again is no news
        set_speed(it, 0)
        it.pause(3.0)
        set_speed(it, 1)
        it.pause(20.0)
        assert count_told(it) == 1
        rotor.speed = 3000.0
        it.pause(10.0)
        assert count_told(it) == 1
        rotor.speed = 0.0
        it.pause(20.0)
        assert count_told(it) == 2
    bench.run_ready(body)


def test_fan_that_turns_or_is_off(tmp_path, monkeypatch):
    bench, rotor = make(tmp_path, monkeypatch)

    def body(it):
        it.pause(20.0)
        for _ in range(3):
            set_speed(it, 1)
            it.pause(3.0)            # slow to start
            rotor.speed = 3000.0
            it.pause(10.0)
            set_speed(it, 0)
            it.pause(1.0)
            rotor.speed = 0.0
            it.pause(10.0)
        assert count_told(it) == 0
    bench.run_ready(body)


def test_absent_mcu_of_the_tachometer(tmp_path, monkeypatch):
    check_absent(*make(tmp_path, monkeypatch, "PA1", "aux:PA2", AUX))


def test_absent_mcu_of_the_fan(tmp_path, monkeypatch):
    check_absent(*make(tmp_path, monkeypatch, "aux:PA1", "PA2", AUX))


def test_short_cut_while_the_fan_starts(tmp_path, monkeypatch):
    """What was reported before the cut does not count for the time of it."""
    bench, rotor = make(tmp_path, monkeypatch, "PA1", "aux:PA2", AUX)

    def body(it):
        it.pause(5.0)
        set_speed(it, 1)
        it.pause(3.0)
        link = it.machine.mcus["aux"].link
        link.cut()
        rotor.speed = 3000.0
        it.pause(4.0)
        link.restore()
        it.pause(10.0)
        assert not any("aux" in line for line in it.output)
        assert it.get("fan_generic vent")["rpm"] > 2900.0
        assert count_told(it) == 0
    bench.run_ready(body)


def check_absent(bench, rotor):
    """While its board is gone nobody knows; once it is back a stuck fan is told."""
    def body(it):
        rotor.speed = 3000.0
        set_speed(it, 1)
        it.pause(5.0)
        link = it.machine.mcus["aux"].link
        link.cut()
        rotor.speed = 0.0
        it.pause(8.0)
        assert it.get("mcu aux")["non_critical_disconnected"]
        it.pause(20.0)
        assert count_told(it) == 0
        link.restore()
        it.pause(4.0)
        assert not it.get("mcu aux")["non_critical_disconnected"]
        assert count_told(it) == 0
        it.pause(8.0)
        assert count_told(it) == 1
    bench.run_ready(body)


def test_hotend_goes_on(tmp_path, monkeypatch):
    bench = OutputsBench(tmp_path, monkeypatch, HOTEND)
    Rotor(bench, "PA2", 2)

    def body(it):
        it.send("SET_HEATER_TEMPERATURE HEATER=block TARGET=60")
        it.pause(12.0)
        assert count_told(it, "heater_fan hotend") == 1
        assert it.get("heater_generic block")["target"] == 60.0
        assert it.get("heater_fan hotend")["rpm"] == 0.0
    bench.run_ready(body)


def test_nothing_without_a_tachometer(tmp_path, monkeypatch):
    bench = OutputsBench(tmp_path, monkeypatch, "[fan_generic vent]\npin: PA1\n")

    def body(it):
        set_speed(it, 1)
        it.pause(20.0)
        assert count_told(it) == 0
    bench.run_ready(body)
