# SPDX-License-Identifier: GPL-3.0-or-later
"""Heaters, sensors, fans and pins on the simulated machine, real firmware."""
import bench_machine
import pytest

CONFIG = """
[mcu]
serial: /dev/none
[printer]
kinematics: none
max_velocity: 100
max_accel: 1000
[heater_bed]
heater_pin: PH5
sensor_type: EPCOS 100K B57560G104F
sensor_pin: PK6
control: watermark
min_temp: 0
max_temp: 130
[heater_generic block]
heater_pin: !PB4
sensor_type: ATC Semitec 104GT-2
sensor_pin: PK5
control: pid
pid_kp: 22.2
pid_ki: 1.08
pid_kd: 114
min_temp: 0
max_temp: 260
gcode_id: T0
[simulator]
heater_power: block=40
heat_capacity: block=10
heat_loss: block=0.065
ambient_temp: 22
[temperature_sensor room]
sensor_type: PT1000
sensor_pin: PK7
min_temp: -20
max_temp: 80
[fan]
pin: PH6
[heater_fan nozzle]
pin: PH4
heater: block
[output_pin light]
pin: !PC1
[fan_generic hard]
pin: PC2
hardware_pwm: true
cycle_time: 0.001
"""


@pytest.fixture
def make_bench(tmp_path, monkeypatch):
    def make(config=CONFIG, **options):
        return bench_machine.Bench(tmp_path, monkeypatch, config, **options)
    return make


def test_room_temperature_at_the_start(make_bench):
    def body(it):
        assert it.printer.state == "ready", it.printer.state_message
        it.pause(5.0)
        for name in ("heater_bed", "heater_generic block",
                     "temperature_sensor room"):
            assert it.get(name)["temperature"] == pytest.approx(22.0, abs=0.5)
        it.send("M105")
        assert it.output[-1] == "B:%.1f /0.0 T0:%.1f /0.0" % (
            it.get("heater_bed")["temperature"],
            it.get("heater_generic block")["temperature"])
    make_bench().run(body)


def test_pid_brings_the_block_to_its_target(make_bench):
    def body(it):
        it.send("SET_HEATER_TEMPERATURE HEATER=block TARGET=210")
        it.send('TEMPERATURE_WAIT SENSOR="heater_generic block" MINIMUM=209')
        it.pause(60.0)
        for _ in range(40):
            it.pause(0.5)
            assert it.machine.get_temperatures()[
                "heater_generic block"] == pytest.approx(210.0, abs=1.5)
        assert it.get("heater_fan nozzle")["speed"] == 1.0
        assert it.machine.thermal.fan_duties["heater_fan nozzle"] == 1.0
    make_bench().run(body)


def test_waits_report_every_second(make_bench):
    def body(it):
        it.output.clear()
        start = it.world.monotonic()
        it.send("M190 S45")
        assert len(it.output) == pytest.approx(
            it.world.monotonic() - start, abs=1.5)
        assert it.get("heater_bed")["temperature"] >= 43.0
    make_bench().run(body)


def test_pid_calibration_ends_with_usable_gains(make_bench):
    def body(it):
        it.send("PID_CALIBRATE HEATER=block TARGET=200")
        text = "\n".join(it.output)
        assert "PID parameters: pid_Kp=" in text
        pending = it.get("configfile")["save_config_pending_items"]
        gains = {k.lower(): float(v) for k, v in
                 pending["heater_generic block"].items()
                 if k.lower().startswith("pid_")}
        assert set(gains) == {"pid_kp", "pid_ki", "pid_kd"}
        assert 5.0 < gains["pid_kp"] < 100.0
        assert it.get("heater_generic block")["target"] == 0.0
    make_bench().run(body)


def test_fan_and_pins_reach_the_machine(make_bench):
    def body(it):
        it.send("M106 S127.5\nSET_PIN PIN=light VALUE=1\n"
                "SET_FAN_SPEED FAN=hard SPEED=0.25")
        it.pause(3.0)
        assert it.machine.thermal.fan_duties["fan"] == pytest.approx(
            0.5, abs=0.01)
        assert it.machine.thermal.fan_duties[
            "fan_generic hard"] == pytest.approx(0.25, abs=0.01)
        assert it.get("output_pin light")["value"] == 1.0
        it.send("M107")
        it.pause(3.0)
        assert it.machine.thermal.fan_duties["fan"] == 0.0
    make_bench().run(body)


def test_heater_goes_off_when_the_cable_is_cut(make_bench):
    def body(it):
        it.send("SET_HEATER_TEMPERATURE HEATER=block TARGET=250")
        it.pause(15.0)
        heater = next(h for h in it.machine.thermal.heaters
                      if h.name == "heater_generic block")
        assert heater.duty == 1.0
        it.machine.mcus["mcu"].link.cut()
        it.pause(5.5)
        assert heater.duty == 0.0
    make_bench().run(body)


def test_overheating_shuts_the_mcu_down_with_a_hint(make_bench):
    def body(it):
        block = next(h for h in it.machine.thermal.heaters
                     if h.name == "heater_bed")
        block.model.temperature = block.model.sensor_temperature = 140.0
        it.pause(3.0)
        assert it.printer.state == "shutdown"
        message = it.printer.state_message
        assert "ADC out of range" in message
        assert "Sensor of 'heater_bed' (pin PK6 of mcu 'mcu') reads 1" in message
        assert "'heater_generic block'" not in message
    make_bench().run(body)


def test_heater_that_is_too_weak_is_found_out(make_bench):
    config = CONFIG.replace("heater_power: block=40", "heater_power: block=0.1")

    def body(it):
        it.send("SET_HEATER_TEMPERATURE HEATER=block TARGET=200")
        it.pause(30.0)
        assert it.printer.state == "shutdown"
        assert "not heating at expected rate" in it.printer.state_message
    make_bench(config).run(body)


def test_same_seed_same_bytes(make_bench):
    def record(seed):
        it = make_bench(seed=seed)
        link = it.machine.mcus["mcu"].link
        link.record(True)

        def body(it):
            it.send("M190 S30")
            it.send("M106 S100")
            it.pause(2.0)
        it.run(body)
        return link.take()
    first = record(5)
    assert len(first) > 100
    assert first == record(5)
    assert first != record(6)
