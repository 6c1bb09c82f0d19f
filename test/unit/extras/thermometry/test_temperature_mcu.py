# SPDX-License-Identifier: GPL-3.0-or-later
"""temperature_mcu: on the simulated board, and chip by chip against data sheets."""
import pytest
from bench_printer import Printer
from outputs_bench import OutputsBench

from klippy.errors import ConfigError
from klippy.extras import temperature_mcu

SENSOR = "[temperature_sensor chip]\nsensor_type: temperature_mcu\n%s\n"


def run(tmp_path, monkeypatch, more, body, is_ready=True):
    bench = OutputsBench(tmp_path, monkeypatch, SENSOR % (more,)
                         + "[simulator]\nambient_temp: 33\n")
    (bench.run_ready if is_ready else bench.run)(body)


def test_simulated_board(tmp_path, monkeypatch):
    def body(it):
        it.pause(2.0)
        assert it.get("temperature_sensor chip")["temperature"] == pytest.approx(
            33.0, abs=0.3)
    run(tmp_path, monkeypatch, "min_temp: 0\nmax_temp: 80", body)


def test_board_too_hot(tmp_path, monkeypatch):
    def body(it):
        it.pause(3.0)
        assert it.printer.is_shutdown()
        assert ("'temperature_sensor chip' (pin mcu:ADC_TEMPERATURE of mcu 'mcu') reads"
                in it.printer.state_message)
    run(tmp_path, monkeypatch, "min_temp: 0\nmax_temp: 30", body, False)


def test_points_of_the_users_own(tmp_path, monkeypatch):
    """The board shows 0.5 + (33 - 25) * 0.002 = 0.516."""
    def body(it):
        it.pause(2.0)
        assert it.get("temperature_sensor chip")["temperature"] == pytest.approx(
            10 + 1.6, abs=0.3)
    run(tmp_path, monkeypatch, "sensor_temperature1: 10\nsensor_adc1: 0.5\n"
        "sensor_temperature2: 20\nsensor_adc2: 0.6", body)


def test_one_point_moves_the_line(tmp_path, monkeypatch):
    def body(it):
        it.pause(2.0)
        assert it.get("temperature_sensor chip")["temperature"] == pytest.approx(
            48.0, abs=0.3)
    run(tmp_path, monkeypatch, "sensor_temperature1: 40\nsensor_adc1: 0.5", body)


class Chip:
    """An mcu of a family, with what its maker left in its memory."""

    def __init__(self, name, memory, pins=()):
        self.name, self.memory, self.pins = name, memory, pins

    def get_enumerations(self):
        return {"pin": dict.fromkeys(self.pins, 0)}

    def get_constants(self):
        return {"MCU": self.name}

    def is_fileoutput(self):
        return False

    def lookup_query_command(self, command, response):
        assert command == "debug_read order=%c addr=%u"
        return self

    def send(self, params):
        order, address = params
        value = self.memory[address]
        return {"val": value & (0xffff if order == 1 else 0xffffffff)}


def identify(name, memory=None, pins=(), **options):
    printer = Printer({"temperature_sensor chip": options})
    printer.invoke_async_shutdown = printer.invoke_shutdown
    sensor = temperature_mcu.PrinterTemperatureMCU(
        printer.make_section("temperature_sensor chip"))
    printer.objects["mcu"] = Chip(name, memory or {}, pins)
    told = []
    sensor.setup_callback(lambda time, temp: told.append(temp))
    sensor.setup_minmax(0.0, 100.0)
    printer.send("klippy:mcu_identify")
    return printer, sensor, told


def calibrate(name, memory=None, **options):
    return identify(name, memory, **options)[1].adc_convert


# (chip, volts at 3.3 V, degC): the data sheets' typical values
@pytest.mark.parametrize("name,volts,temp", [
    ("rp2040", 0.706, 27.0), ("rp2040", 0.706 - 0.001721 * 10, 37.0),
    ("sam3x8e", 0.8 + 0.0265, 37.0), ("sam4e8e", 1.44, 27.0),
    ("same70q20b", 0.72 + 0.0233, 35.0), ("stm32f103xe", 1.43 - 0.043, 35.0),
    ("stm32f207xx", 0.76 + 0.025, 35.0), ("stm32f070xb", 1.43, 30.0)])
def test_typical(name, volts, temp):
    line = calibrate(name)
    assert line.calc_temp(volts / 3.3) == pytest.approx(temp)
    assert line.calc_adc(temp) == pytest.approx(volts / 3.3)


# TS_CAL1 at 30 degC and TS_CAL2, both at the given reference
@pytest.mark.parametrize("name,low,high,hot,reference,scale", [
    ("stm32f446xx", 0x1fff7a2c, 0x1fff7a2e, 110, 3.3, 4095),
    ("stm32f042x6", 0x1ffff7b8, 0x1ffff7c2, 110, 3.3, 4095),
    ("stm32g0b1xx", 0x1fff75a8, 0x1fff75ca, 130, 3.0, 4095),
    ("stm32h743xx", 0x1ff1e820, 0x1ff1e840, 110, 3.3, 65535),
    ("stm32h723xx", 0x1ff1e820, 0x1ff1e840, 130, 3.3, 65535)])
def test_measured_by_the_maker(name, low, high, hot, reference, scale):
    memory = {low: int(0.23 * scale), high: int(0.30 * scale)}
    line = calibrate(name, memory)
    at_30, at_hot = (int(share * scale) / scale * reference / 3.3
                     for share in (0.23, 0.30))
    assert line.calc_temp(at_30) == pytest.approx(30.0)
    assert line.calc_temp(at_hot) == pytest.approx(hot)


def test_samd21():
    """Room 25.3 degC reads 2700 at a reference of 1.010 V, hot 83.2: 3280 at 0.995."""
    low = 25 | 3 << 8 | 83 << 12 | 2 << 20 | (256 - 10) << 24
    high = 5 | 2700 << 8 | 3280 << 20
    line = calibrate("samd21g18a", {0x00806030: low, 0x00806034: high})
    assert line.calc_temp(1.010 * 2700 / 4095 / 3.3) == pytest.approx(25.3)
    assert line.calc_temp(0.995 * 3280 / 4095 / 3.3) == pytest.approx(83.2)


def test_reference_voltage():
    line = calibrate("rp2040", reference_voltage=3.0)
    assert line.calc_temp(0.706 / 3.0) == pytest.approx(27.0)


@pytest.mark.parametrize("name,memory", [
    ("atmega2560", {}), ("stm32f446xx", {0x1fff7a2c: 0xffff, 0x1fff7a2e: 0xffff})])
def test_nothing_is_known(name, memory):
    with pytest.raises(ConfigError, match="give sensor_temperature1"):
        calibrate(name, memory)


# Volts of the two sensors of a D51 at degC: one rises, one falls
def calc_rising(temp):
    return 0.667 + 0.0022 * (temp - 25.0)


def calc_falling(temp):
    return 0.7 - 0.0017 * (temp - 25.0)


def make_log_row():
    """What the maker writes: read at 25.3 and 83.2 degC, by 1 V."""
    rising, falling = ([round(calc(temp) * 4095) for temp in (25.3, 83.2)]
                       for calc in (calc_rising, calc_falling))
    words = [25 | 3 << 8 | 83 << 12 | 2 << 20,
             rising[0] << 8 | rising[1] << 20, falling[0] | falling[1] << 12]
    return {0x00800100 + 4 * i: word for i, word in enumerate(words)}


PINS = ("ADC_TEMPERATURE", "ADC_TEMPERATURE_CTAT")


def show(printer, temp, supply=3.3):
    """Have both sensors report."""
    for pin, calc in zip(PINS[::-1], (calc_falling, calc_rising), strict=True):
        printer.pins["mcu:" + pin].report(1.0, calc(temp) / supply)


@pytest.mark.parametrize("chip", ["samd51p20a", "same51j19a", "same54p20a"])
@pytest.mark.parametrize("temp", [-20.0, 25.3, 41.0, 83.2, 110.0])
@pytest.mark.parametrize("supply", [3.3, 3.1])
def test_two_sensors(chip, temp, supply):
    """The supply's voltage does not count."""
    printer, _, told = identify(chip, make_log_row(), PINS)
    show(printer, temp, supply)
    assert told == [pytest.approx(temp, abs=0.2)]


def test_two_sensors_tell_nothing_before_both_were_read():
    printer, sensor, told = identify("samd51p20a", make_log_row(), PINS)
    printer.pins["mcu:ADC_TEMPERATURE"].report(1.0, calc_rising(30.0) / 3.3)
    assert told == [] and sensor._explain_shutdown("", {"mcu": "mcu"}) is None


def test_two_sensors_outside_the_range():
    printer, _, _ = identify("samd51p20a", make_log_row(), PINS)
    for temp in (105.0, 105.0, 105.0, 95.0, 105.0, 105.0, 105.0):
        show(printer, temp)
        assert not printer.is_shutdown()
    show(printer, 105.0)
    message = printer.shutdown_message
    assert "'temperature_sensor chip' (mcu 'mcu') reads 105." in message
    assert "0.0..100.0" in message


@pytest.mark.parametrize("memory,pins,options,text", [
    ({}, PINS[:1], {}, "does not show the second sensor.*give sensor_temperature1"),
    (dict.fromkeys(make_log_row(), 0xffffffff), PINS, {}, "has no calibration"),
    (dict.fromkeys(make_log_row(), 0), PINS, {}, "has no calibration"),
    (make_log_row(), PINS, {"sensor_temperature1": 30, "sensor_adc1": 0.2},
     "give two, or none")])
def test_two_sensors_without_what_they_need(memory, pins, options, text):
    with pytest.raises(ConfigError, match=text):
        identify("samd51p20a", memory, pins, **options)


def test_two_sensors_with_points_of_the_users_own():
    _, sensor, _ = identify(
        "samd51p20a", {}, PINS[:1], sensor_temperature1=20, sensor_adc1=0.2,
        sensor_temperature2=40, sensor_adc2=0.3)
    assert sensor.adc_convert.calc_temp(0.25) == pytest.approx(30.0)
