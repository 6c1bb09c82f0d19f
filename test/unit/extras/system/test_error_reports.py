# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user reads when a pin, a sensor or a board is wrong: who, where, what."""
import pytest
from outputs_bench import OutputsBench

SENSORS = """
[mcu tool]
serial: /dev/none
[heater_generic block]
heater_pin: PB4
sensor_type: Generic 3950
sensor_pin: PK5
control: watermark
min_temp: 0
max_temp: 200
[temperature_sensor chamber]
sensor_type: PT1000
sensor_pin: tool:PK6
min_temp: 0
max_temp: 90
"""


@pytest.mark.parametrize("mcu,pin,fraction,parts", [
    ("mcu", "PK5", 0.0, ["Sensor of 'heater_generic block' (pin PK5 of mcu 'mcu') reads"
                         " nothing (0 V, like a short to ground)",
                         "outside its range 0.0..200.0"]),
    ("mcu", "PK5", 0.02, ["heater_generic block", "pin PK5", "reads 3",
                          "outside its range 0.0..200.0"]),
    ("tool", "tool:PK6", 1.0, [
        "Sensor of 'temperature_sensor chamber' (pin tool:PK6 of mcu 'tool') reads"
        " nothing (full scale", "outside its range 0.0..90.0"])])
def test_adc_out_of_range(tmp_path, monkeypatch, mcu, pin, fraction, parts):
    def body(it):
        it.pause(3.0)
        it.machine.thermal.inputs.clear()
        it.machine.mcus[mcu].set_adc(it.machine.pins.lookup(pin).number, fraction)
        it.pause(3.0)
        message = it.printer.get_state_message()[0]
        assert message.startswith("MCU '%s' shutdown: ADC out of range\n" % (mcu,))
        for part in parts:
            assert part in message
        # the other sensor is not blamed
        assert message.count("Sensor of") == 1
    OutputsBench(tmp_path, monkeypatch, SENSORS).run(body)


@pytest.mark.parametrize("config,parts", [
    ("[output_pin a]\npin: tol:PA1\n[mcu tool]\nserial: /dev/none\n",
     ["Unknown pin chip name 'tol'", "[output_pin a] pin at", "did you mean 'tool'?"]),
    ("[output_pin a]\npin: PA1\n[output_pin b]\npin: !PA1\n",
     ["Pin 'PA1' is used more than once", "[output_pin a] pin at",
      "[output_pin b] pin at", "printer.cfg:9", "printer.cfg:11"]),
    ("[static_digital_output a]\npins: PA2, !PA1\n[output_pin b]\npin: PA1\n",
     ["Pin 'PA1' is used more than once", "[static_digital_output a] pins at",
      "[output_pin b] pin at"]),
    ("[board_pins]\naliases: LED=PA1\n[output_pin a]\npin: PA1\n"
     "[output_pin b]\npin: LED\n",
     ["in use both as 'PA1' and as 'LED'", "[output_pin a] pin at",
      "[output_pin b] pin at"]),
    ("[board_pins]\naliases: EXP1=<GND>\n[output_pin b]\npin: EXP1\n",
     ["Pin 'EXP1' of chip 'mcu' ([output_pin b] pin at", "is reserved for <GND>"]),
    ("[temperature_sensor a]\nsensor_type: PT1001\nsensor_pin: PK1\n",
     ["Unknown temperature sensor 'PT1001' in section 'temperature_sensor a'"]),
    ("[led a]\nred_pin: ^PA1\n",
     ["Pin '^PA1' ([led a] red_pin at", "cannot have a pull-up"]),
    ("[output_pin a]\npin: PZ99\n[output_pin b]\npin PA1: 3\n", ["pin pa1"])])
def test_config_errors(tmp_path, monkeypatch, config, parts):
    def body(it):
        assert it.printer.state == "error"
        for part in parts:
            assert part in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, config).run(body)


@pytest.mark.parametrize("config,parts", [
    ("[static_digital_output a]\npins: PA2, !QQ1\n",
     ["'QQ1' is not a valid pin name on mcu 'mcu'",
      "[static_digital_output a] pins at"]),
    ("[board_pins]\naliases:\n  A=PA1,\n  LED=QQ1\n[output_pin a]\npin: LED\n",
     ["'QQ1' is not a valid pin name on mcu 'mcu'", "[board_pins] aliases at"]),
    ("[output_pin a]\npin: tool:QQ1\n[mcu tool]\nserial: /dev/none\n",
     ["'QQ1' is not a valid pin name on mcu 'tool'", "[output_pin a] pin at"])])
def test_unknown_pins(tmp_path, monkeypatch, config, parts):
    """The simulated board takes any name, except this one."""
    def body(it):
        assert it.printer.state == "error"
        for part in parts:
            assert part in it.printer.state_message
    bench = OutputsBench(tmp_path, monkeypatch, config)
    get_pin_map = bench.machine.get_pin_map
    monkeypatch.setattr(bench.machine, "get_pin_map", lambda name: {
        pin: number for pin, number in get_pin_map(name).items() if pin != "QQ1"})
    bench.run(body)


def test_same_pin_allowed(tmp_path, monkeypatch):
    def body(it):
        assert it.printer.state == "ready", it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, """
[duplicate_pin_override lamps]
pins: PA1
[duplicate_pin_override]
pins: PA2, PA3
[output_pin a]
pin: PA1
[output_pin b]
pin: PA1
""").run(body)


def test_board_that_does_not_answer(tmp_path, monkeypatch):
    def body(it):
        assert it.printer.state == "error"
        assert it.printer.state_message.startswith("mcu 'tool': ")
        assert "Check the cable" in it.printer.state_message
    bench = OutputsBench(tmp_path, monkeypatch, SENSORS)
    bench.machine.mcus["tool"].link.cut()
    bench.run(body)


def test_board_that_is_lost(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        it.machine.mcus["tool"].link.cut()
        it.pause(10.0)
        assert it.printer.state_message.startswith(
            "Lost communication with MCU 'tool'\n")
        assert "cable and power" in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, SENSORS).run(body)
