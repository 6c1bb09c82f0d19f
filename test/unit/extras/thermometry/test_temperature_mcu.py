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

    def __init__(self, name, memory):
        self.name, self.memory = name, memory

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


def calibrate(name, memory=None, **options):
    printer = Printer({"temperature_sensor chip": options})
    sensor = temperature_mcu.PrinterTemperatureMCU(
        printer.make_section("temperature_sensor chip"))
    printer.objects["mcu"] = Chip(name, memory or {})
    sensor.setup_callback(lambda time, temp: None)
    printer.send("klippy:mcu_identify")
    return sensor.adc_convert


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
