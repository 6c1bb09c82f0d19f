# SPDX-License-Identifier: GPL-3.0-or-later
"""Sensors that read a heater's model, against the simulated heater itself."""
import heating_machine as machine
import pytest

BLOCK = """
[temperature_sensor block]
sensor_type: mpc_block_temperature
heater_name: extruder
gcode_id: BE
"""
AIR = """
[temperature_sensor air]
sensor_type: mpc_ambient_temperature
heater_name: extruder
"""


@pytest.fixture
def bench(tmp_path, monkeypatch):
    def make(config):
        return machine.HeatingBench(tmp_path, monkeypatch, machine.COMMON + config)
    return make


def read(it, name):
    return it.get("temperature_sensor " + name)["temperature"]


def test_block_is_ahead_of_the_sensor(bench):
    def body(it):
        it.send("M104 S250")
        it.pause(5.0)
        for _ in range(20):
            it.pause(1.0)
            # 3.5 K/s: the sensor in the block is 1.5 s behind it; the model is not,
            # but two times 0.3 s pass until it is read
            assert it.heater().last_temp < it.block() - 4.5
            assert it.block() - 2.3 < read(it, "block") < it.block() + 0.5
        it.send("TEMPERATURE_WAIT SENSOR='temperature_sensor block' MINIMUM=200")
        assert it.block() == pytest.approx(200.0, abs=8.0)
        it.send("M105")
        assert "BE:20" in it.output[-1]
        assert "temperature_sensor block" in it.get("heaters")["available_sensors"]
    bench(machine.CALIBRATED + BLOCK).run_ready(body)


@pytest.mark.parametrize("room", [8, 38])
def test_ambient_is_the_room(bench, room):
    def body(it):
        it.pause(3.0)
        assert read(it, "air") == pytest.approx(room, abs=0.5)
        it.send("M104 S200")
        it.pause(150.0)
        assert read(it, "air") == pytest.approx(room, abs=6.0)
    bench(machine.CALIBRATED + AIR + "[simulator]\nambient_temp: %d\n" % room
          ).run_ready(body)


@pytest.mark.parametrize("control", [machine.PID, machine.MPC])
def test_without_a_model(bench, control):
    """Another control, and one that is not calibrated."""
    def body(it):
        it.pause(5.0)
        if control == machine.PID:
            it.send("M104 S150")
            it.pause(90.0)
        assert read(it, "block") == pytest.approx(it.block(), abs=1.0)
        assert read(it, "air") == 25.0
    bench(control + BLOCK + AIR).run_ready(body)


def test_limit_shuts_down(bench):
    def body(it):
        it.send("M104 S150")
        it.follow(60.0)
        assert it.printer.is_shutdown()
        assert ("'temperature_sensor block': the block of the model of heater"
                " 'extruder' is" in it.printer.state_message)
        assert "outside its range 0.0..100.0" in it.printer.state_message
        assert it.block() < 110.0
    bench(machine.CALIBRATED + BLOCK + "min_temp: 0\nmax_temp: 100\n").run(body)


@pytest.mark.parametrize("is_loud", [False, True])
def test_limits_can_be_ignored(bench, is_loud):
    def body(it):
        it.send("M104 S150")
        it.pause(60.0)
        assert not it.printer.is_shutdown(), it.printer.state_message
        assert read(it, "block") == pytest.approx(150.0, abs=1.0)
        told = [line for line in it.output if "outside its range" in line]
        assert len(told) == is_loud
    bench(machine.CALIBRATED + BLOCK + "max_temp: 100\nignore_limits: True\n"
          "echo_limits_to_console: %s\n" % is_loud).run_ready(body)


@pytest.mark.parametrize("config,error", [
    (BLOCK.replace("heater_name: extruder", "heater_name: oven"),
     "Unknown heater 'oven'"),
    (BLOCK.replace("heater_name: extruder\n", ""), "heater_name"),
    (machine.BED.replace("sensor_type: EPCOS 100K B57560G104F\nsensor_pin: PK6",
                         "sensor_type: mpc_block_temperature\nheater_name: extruder")
     + "control: watermark\n", "a heater needs a sensor that measures")])
def test_bad_options_are_explained(bench, config, error):
    def body(it):
        assert it.printer.state == "error"
        assert error in it.printer.state_message
    bench(machine.CALIBRATED + config).run(body)
