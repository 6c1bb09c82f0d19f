# SPDX-License-Identifier: GPL-3.0-or-later
"""Every ADC sensor type on the simulated machine: voltage at the pin to degC."""
import math

import pytest
from outputs_bench import OutputsBench

from klippy.extras import thermistor

# What is at the pin, by data sheets and text books, not by our tables


def divider(ohm, pullup=4700.0):
    return ohm / (ohm + pullup)


def platinum(temp, r0):
    return r0 * (1 + 3.9083e-3 * temp - 5.775e-7 * temp * temp)


def beta(temp, r25, constant):
    return r25 * math.exp(constant * (1 / (temp + 273.15) - 1 / 298.15))


CASES = {
    # R/T tables of the makers
    ("EPCOS 100K B57560G104F", 150.0, ""): divider(1641.9),
    ("EPCOS 100K B57560G104F", 100.0, ""): divider(beta(100, 1e5, 4092)),
    ("ATC Semitec 104GT-2", 150.0, ""): divider(1360.0),
    ("ATC Semitec 104NT-4-R025H42G", 160.0, ""): divider(1074.0),
    ("Generic 3950", 150.0, ""): divider(1770.0),
    ("SliceEngineering 450", 200.0, ""): divider(3734.0),
    ("TDK NTCG104LH104JT1", 50.0, ""): divider(31230.0),
    ("Honeywell 100K 135-104LAG-J01", 100.0, ""): divider(beta(100, 1e5, 3974)),
    ("NTC 100K MGB18-104F39050L32", 100.0, ""): divider(beta(100, 1e5, 4100)),
    ("Generic 3950", 25.0, "pullup_resistor: 1000\ninline_resistor: 500"):
        (100500.0 / 101500.0),
    ("PT1000", 100.0, ""): divider(1385.06),
    ("PT1000", 200.0, "pullup_resistor: 1000\ninline_resistor: 100"):
        1858.56 / 2858.56,
    # E3D's board: the sensor below 4.4 kohm at 5 V, times 10
    ("PT100 INA826", 100.0, ""): 10 * 138.506 / 4538.506,
    ("PT100 INA826", 100.0, "adc_voltage: 3.3"): 50 * 138.506 / 4538.506 / 3.3,
    # output voltages that the data sheets list
    ("AD595", 100.0, ""): 1.015 / 5, ("AD597", 100.0, ""): 1.012 / 5,
    ("AD8495", 300.0, ""): 1.499 / 5, ("AD8497", 300.0, "adc_voltage: 3.3"):
        (1.499 + 0.0006) / 3.3,
    ("AD8494", 25.0, "voltage_offset: 0.5"): 0.625 / 5,
    ("AD8496", 60.0, ""): 0.300 / 5,
    ("mine", 100.0, ""): divider(2000.0), ("mine", 150.0, ""): divider(1250.0),
    ("volts", 100.0, "adc_voltage: 3.3"): 1.5 / 3.3,
    ("steps", 37.0, ""): divider(beta(37, 1e5, 3950)),
}
CUSTOM = """
[adc_temperature mine]
temperature1: 100
resistance1: 2000
temperature2: 200
resistance2: 500
[adc_temperature volts]
temperature1: 0
voltage1: 0.5
temperature2: 200
voltage2: 2.5
[thermistor steps]
temperature1: 25
resistance1: 100000
beta: 3950
"""


def test_all_types(tmp_path, monkeypatch):
    """Half a degree for the 12 bits of the ADC, a percent for the resistances."""
    config, cases = CUSTOM, []
    for index, ((kind, temp, more), fraction) in enumerate(CASES.items()):
        config += ("[temperature_sensor s%d]\nsensor_type: %s\nsensor_pin: PK%d\n%s\n"
                   % (index, kind, index, more))
        cases.append((index, kind, temp, fraction))

    def body(it):
        mcu = it.machine.mcus["mcu"]
        it.machine.thermal.inputs.clear()
        for index, _, _, fraction in cases:
            mcu.set_adc(it.machine.pins.lookup("PK%d" % (index,)).number, fraction)
        it.pause(3.0)
        for index, kind, temp, _ in cases:
            read = it.get("temperature_sensor s%d" % (index,))["temperature"]
            assert read == pytest.approx(temp, abs=0.6 + 0.005 * temp), (kind, read)
    OutputsBench(tmp_path, monkeypatch, config).run_ready(body)


def test_three_points_of_the_users_own(tmp_path, monkeypatch):
    points = [(t, beta(t, 1e5, 4092)) for t in (25.0, 150.0, 250.0)]
    curve = thermistor.fit(points)
    for temp in range(0, 300, 25):
        assert curve.temperature(beta(temp, 1e5, 4092)) == pytest.approx(temp, abs=0.05)


HOST = "[temperature_sensor host]\nsensor_type: temperature_host\n%s\n"


def test_host(tmp_path, monkeypatch):
    path = tmp_path / "temp"
    path.write_text("48123\n")

    def body(it):
        it.pause(2.0)
        assert it.get("temperature_sensor host")["temperature"] == 48.12
        assert it.get("temperature_host host") == {"temperature": 48.12}
        path.write_text("70000\n")
        it.pause(1.5)
        assert it.get("temperature_sensor host")["measured_max_temp"] == 70.0
        path.write_text("")
        it.pause(3.0)
        assert it.get("temperature_sensor host")["temperature"] == 70.0
        path.write_text("41000\n")
        it.pause(1.5)
        assert it.get("temperature_sensor host")["temperature"] == 41.0
    OutputsBench(tmp_path, monkeypatch,
                 HOST % ("sensor_path: %s" % (path,))).run_ready(body)


def test_host_too_hot(tmp_path, monkeypatch):
    path = tmp_path / "temp"
    path.write_text("91000\n")

    def body(it):
        it.pause(2.0)
        assert it.printer.is_shutdown()
        assert ("Sensor of 'temperature_sensor host' (temperature_host) reads 91.0"
                " degC, outside its range 0.0..90.0") in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, HOST % (
        "sensor_path: %s\nmin_temp: 0\nmax_temp: 90" % (path,))).run(body)


def test_host_without_the_file(tmp_path, monkeypatch):
    def body(it):
        assert "no temperature can be read from '/none'" in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, HOST % "sensor_path: /none").run(body)


PAIR = """
[simulator]
ambient_temp: 30
[temperature_sensor a]
sensor_type: Generic 3950
sensor_pin: PK1
[temperature_sensor b]
sensor_type: PT1000
sensor_pin: PK2
[temperature_sensor both]
sensor_type: temperature_combined
sensor_list: temperature_sensor a, temperature_sensor b
combination_method: %s
maximum_deviation: %s
%s
"""


def set_pins(it, a, b):
    mcu = it.machine.mcus["mcu"]
    it.machine.thermal.inputs.clear()
    mcu.set_adc(it.machine.pins.lookup("PK1").number, divider(beta(a, 1e5, 3950)))
    mcu.set_adc(it.machine.pins.lookup("PK2").number, divider(platinum(b, 1000)))
    it.pause(2.0)


@pytest.mark.parametrize("method,expected", [("min", 40), ("max", 50), ("mean", 45)])
def test_combined(tmp_path, monkeypatch, method, expected):
    def body(it):
        it.pause(1.0)
        set_pins(it, 40, 50)
        assert it.get("temperature_sensor both")["temperature"] == pytest.approx(
            expected, abs=0.6)
        status = it.get("temperature_combined both")
        assert status["temperature"] == pytest.approx(expected, abs=0.6)
        assert status["humidity"] is status["pressure"] is status["gas"] is None
    OutputsBench(tmp_path, monkeypatch, PAIR % (method, 15, "")).run_ready(body)


@pytest.mark.parametrize("temps,message", [
    ((40, 60), "'temperature_sensor both' (temperature_combined) differ by more than"
               " 15.0 degC: temperature_sensor a"),
    ((75, 85), "outside its range 10.0..70.0: "), ((5, 0), "outside its range 10.0")])
def test_combined_shuts_down(tmp_path, monkeypatch, temps, message):
    def body(it):
        it.pause(4.0)
        assert not it.printer.is_shutdown(), it.printer.state_message
        set_pins(it, *temps)
        assert it.printer.is_shutdown()
        assert message in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, PAIR % (
        "mean", 15, "min_temp: 10\nmax_temp: 70")).run(body)


def test_combined_of_nothing(tmp_path, monkeypatch):
    def body(it):
        assert ("'output_pin x' is no section with a temperature"
                in it.printer.state_message)
    OutputsBench(tmp_path, monkeypatch, (PAIR % ("mean", 5, "")).replace(
        "temperature_sensor b\n", "output_pin x\n") + "[output_pin x]\npin: PA1\n"
        ).run(body)


def test_scaled_pins(tmp_path, monkeypatch):
    def body(it):
        it.pause(8.0)
        plain = it.get("temperature_sensor plain")["temperature"]
        scaled = it.get("temperature_sensor scaled")["temperature"]
        # 12 bits are steps of 0.45 degC; unscaled it would be 4.5 degC off
        assert plain == pytest.approx(24.0, abs=0.6)
        assert scaled == pytest.approx(24.0, abs=0.6)
        it.send("QUERY_ADC NAME=head:vref")
        assert 'ADC object "head:vref" has value 0.970' in it.output[-1]
        it.send("QUERY_ADC NAME=head:vssa")
        assert "has value 0.00976" in it.output[-1] or "0.010" in it.output[-1]
    OutputsBench(tmp_path, monkeypatch, """
[adc_scaled head]
vref_pin: PF1
vssa_pin: PF2
smooth_time: 0.5
[temperature_sensor plain]
sensor_type: PT1000
sensor_pin: PF3
[temperature_sensor scaled]
sensor_type: PT1000
sensor_pin: head:PF4
[simulator]
ambient_temp: 24
""").run_ready(body)


HEATED = """
[adc_scaled head]
vref_pin: PF1
vssa_pin: PF2
smooth_time: 0.5
[heater_generic h]
heater_pin: PF5
control: watermark
min_temp: 0
max_temp: 200
sensor_type: EPCOS 100K B57560G104F
sensor_pin: head:PF4
"""


@pytest.mark.parametrize("pin,fraction,message", [
    # an open sensor reads the board's reference, which is no full scale
    ("PF4", 0.97, "pin 'head:PF4' of [adc_scaled head]: it reads 1.000"),
    # and one with a short reads its ground: the mcu sees that by itself
    ("PF4", 0.01, "Sensor of 'heater_generic h' (pin head:PF4"),
    ("PF1", 0.012, "vref_pin reads 0.0"), ("PF2", 0.9, "and vssa_pin 0.")])
def test_scaled_pin_out_of_range(tmp_path, monkeypatch, pin, fraction, message):
    def body(it):
        it.pause(5.0)
        assert it.printer.state == "ready"
        thermal = it.machine.thermal
        number = it.machine.pins.lookup(pin).number
        thermal.inputs[:] = [i for i in thermal.inputs if i.pin != number]
        if pin in ("PF1", "PF2"):
            thermal.tick = lambda elapsed: None
        it.machine.mcus["mcu"].set_adc(number, fraction)
        it.pause(5.0)
        assert it.printer.is_shutdown()
        assert message in it.printer.state_message
        if pin == "PF4":
            assert "Sensor of 'heater_generic h'" in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, HEATED).run(body)


def test_scaled_pin_at_its_ends_is_no_fault(tmp_path, monkeypatch):
    """195 degC of 200, for a while: within the range by the board's reference."""
    def body(it):
        for heater in it.machine.thermal.heaters:
            heater.model.temperature = heater.model.sensor_temperature = 195.0
            heater.model.ambient = 195.0
        it.pause(20.0)
        assert it.printer.state == "ready"
        assert it.get("heater_generic h")["temperature"] == pytest.approx(195, abs=1.5)
    OutputsBench(tmp_path, monkeypatch, HEATED).run_ready(body)


def test_scaled_pins_are_analog(tmp_path, monkeypatch):
    def body(it):
        assert "[adc_scaled head] has analog inputs only" in it.printer.state_message
    OutputsBench(tmp_path, monkeypatch, """
[adc_scaled head]
vref_pin: PF1
vssa_pin: PF2
[output_pin x]
pin: head:PF3
""").run(body)
