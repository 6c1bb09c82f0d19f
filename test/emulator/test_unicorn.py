# SPDX-License-Identifier: GPL-3.0-or-later
"""The STM32 firmware on emulated chips: it boots, talks, steps and stops.

Chips are stepped by hand, message by message; edges are compared with the
clocks that were asked for.
"""

import firmware_matrix
import pytest
import unicorn_board
from chip_checks import (
    Pins,
    check_defaults,
    check_i2c,
    check_pulses,
    check_pwm,
    check_shutdown_in_interrupt,
    check_spi,
    check_steps,
    configure,
    read_analog,
    time_to_reset,
)
from step_runs import assert_switch_stops
from unicorn_board import UnicornBoard

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

CHIPS = [name for name in firmware_matrix.CONFIGS if name.startswith("stm32")]
PINS = Pins("PB0", "PB1", "PB3", "PB4", "PA4")
# What a test of the clocks can do without
SMALL = ["WANT_%s=n" % name for name in (
    "BUTTONS", "PULSE_COUNTER", "NEOPIXEL", "TMCUART", "SOFTWARE_SPI",
    "SOFTWARE_I2C", "ADXL345", "HX71X", "LDC1612", "THERMOCOUPLE", "HD44780",
    "ST7920")]
# From a timer's clock to the pin, in instructions
PROMPT = 60


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def make_board(adapter, monkeypatch):
    """make_board(chip, out, crystal): a chip that runs and was identified."""
    def make(chip, out=None, crystal=8000000):
        out = out or firmware_matrix.build(chip)
        unicorn_board.choose_chip(monkeypatch, out, chip, crystal)
        board = UnicornBoard(adapter)
        board.identify()
        return board
    return make


@pytest.mark.parametrize("chip", CHIPS)
def test_chip_from_reset_to_steps(chip, make_board):
    board = make_board(chip)
    constants = board.dictionary["config"]
    assert constants["MCU"].startswith(chip) and constants["ADC_MAX"] == 4095
    check_steps(board, PINS, PROMPT, 100)


@pytest.mark.parametrize("chip", ["stm32f070", "stm32f103", "stm32f446"])
def test_pulses_keep_their_length(chip, make_board):
    board = make_board(chip)
    check_pulses(board, PINS, PROMPT, board.freq // 500000)


@pytest.mark.parametrize("chip", ["stm32f072", "stm32f103", "stm32f407",
                                  "stm32g431", "stm32h743"])
def test_switch_stops_a_stepper(chip, make_board):
    board = make_board(chip)
    configure(board, PINS)
    assert_switch_stops(board, PINS.switch, PINS.step)


@pytest.mark.parametrize("chip", CHIPS)
def test_analog_input(chip, make_board):
    board = make_board(chip)
    configure(board, PINS)
    board.analog[board.find_pin(PINS.sensor)] = 0x5678
    assert read_analog(board)[-1] == 4 * (0x5678 >> 4)


@pytest.mark.parametrize("chip", [
    "stm32f070", "stm32f072", "stm32f103", "stm32f401", "stm32f407", "stm32g0b1",
    "stm32g431", "stm32h743", "stm32l412"])
@pytest.mark.parametrize("cycle_time", [0.00005, 0.1])
def test_hardware_pwm(chip, cycle_time, make_board):
    check_pwm(make_board(chip), "PB8", cycle_time)


@pytest.mark.parametrize("chip", ["stm32f072", "stm32f103", "stm32f407",
                                  "stm32f765", "stm32g431", "stm32h743"])
def test_spi_bus(chip, make_board):
    board = make_board(chip)
    check_spi(board, 1, board.dictionary["enumerations"]["spi_bus"]["spi1"], "PB12")


@pytest.mark.parametrize("chip, bus", [
    ("stm32f072", "i2c1"), ("stm32f103", "i2c1a"), ("stm32f407", "i2c2"),
    ("stm32f765", "i2c1"), ("stm32g0b1", "i2c2_PB13_PB14"),
    ("stm32g431", "i2c1_PB8_PB9"), ("stm32h743", "i2c1"), ("stm32l412", "i2c1")])
def test_i2c_bus(chip, bus, make_board):
    board = make_board(chip)
    check_i2c(board, 2 if "i2c2" in bus else 1,
              board.dictionary["enumerations"]["i2c_bus"][bus])


@pytest.mark.parametrize("chip", ["stm32f070", "stm32f103", "stm32f407",
                                  "stm32g0b1", "stm32h723"])
def test_shutdown_puts_pins_to_their_defaults(chip, make_board):
    check_defaults(make_board(chip), PINS)


@pytest.mark.parametrize("chip", ["stm32f070", "stm32f103", "stm32f407"])
def test_shutdown_within_the_timer_interrupt(chip, make_board):
    check_shutdown_in_interrupt(make_board(chip), PINS, 10)


def test_reset_command(make_board):
    board = make_board("stm32f407")
    board.send("reset")
    assert board.resets


def test_watchdog_resets_a_hung_program(make_board):
    """A timer's event that never ends: here, its code in RAM is a loop."""
    board = make_board("stm32f103")
    vectors = 0x20000000
    systick = board.read_word(vectors + 4 * 15)
    # The vector of SysTick leads to `b .` in the stack's unused part
    board.send("debug_write", order=1, addr=0x20004E10, val=0xE7FE)
    assert systick & 1
    board.send("debug_write", order=2, addr=vectors + 4 * 15, val=0x20004E11)
    assert 0.2 < time_to_reset(board) < 1.1


@pytest.mark.parametrize("chip, crystals", [
    ("stm32f103", [0, 16]), ("stm32f072", [0]), ("stm32f407", [0, 25]),
    ("stm32g0b1", [25]), ("stm32g431", [0]), ("stm32h743", [25]),
    ("stm32l412", [0])])
def test_other_crystals(chip, crystals, make_board, tmp_path):
    """The models refuse a PLL, bus or baud rate that is out of bounds."""
    for mhz in crystals:
        name = "%dM" % (mhz,) if mhz else "INTERNAL"
        out = firmware_matrix.build(
            chip, ("LOW_LEVEL_OPTIONS=y", "STM32_CLOCK_REF_%s=y" % (name,), *SMALL),
            tmp_path / chip)
        assert firmware_matrix.read_options(out)["STM32_CLOCK_REF_" + name] == "y"
        board = make_board(chip, out, mhz * 1000000)
        assert board.query("get_config", "config")["is_config"] == 0


def test_console_on_other_pins(make_board, tmp_path):
    out = firmware_matrix.build(
        "stm32g431", ("LOW_LEVEL_OPTIONS=y", "STM32_CLOCK_REF_INTERNAL=y",
                      "STM32_SERIAL_USART2_ALT_PB4_PB3=y", *SMALL), tmp_path / "g4")
    constants = firmware_matrix.read_constants(out)
    assert constants["RESERVE_PINS_serial"] == "PB4,PB3"
    assert "RESERVE_PINS_crystal" not in constants
    board = make_board("stm32g431", out, 0)
    assert board.dictionary["config"]["RESERVE_PINS_serial"] == "PB4,PB3"


@pytest.mark.parametrize("chip, choice, pins", [
    ("stm32g0b1", "USART5", "PD2,PD3"), ("stm32f401", "USART6", "PA12,PA11")])
def test_console_on_more_usarts(chip, choice, pins, make_board, tmp_path):
    out = firmware_matrix.build(
        chip, ("STM32_SERIAL_%s=y" % (choice,), *SMALL), tmp_path / chip)
    board = make_board(chip, out)
    assert board.dictionary["config"]["RESERVE_PINS_serial"] == pins


@pytest.mark.parametrize("chip, bus, pins, functions", [
    ("stm32g0b1", "spi2_PB2_PB11_PB10", ["PB2", "PB11", "PB10"], [1, 0, 5]),
    ("stm32g0b1", "spi2_PB6_PB7_PB8", ["PB6", "PB7", "PB8"], [4, 1, 1]),
    ("stm32g431", "spi2_PA10_PA11_PF1", ["PA10", "PA11", "PF1"], [5, 5, 5]),
    ("stm32f429", "spi6_PG12_PG14_PG13", ["PG12", "PG14", "PG13"], [5, 5, 5])])
def test_pins_of_spi_buses(chip, bus, pins, functions, make_board):
    board = make_board(chip)
    number = board.dictionary["enumerations"]["spi_bus"][bus]
    base = {"stm32f429": 0x40020000, "stm32g431": 0x48000000}.get(chip, 0x50000000)
    assert board.dictionary["config"]["BUS_PINS_" + bus] == ",".join(pins)
    board.configure(
        ("config_spi", dict(oid=5, pin=board.find_pin("PB12"), cs_active_high=0)),
        ("spi_set_bus", dict(oid=5, spi_bus=number, mode=0, rate=1000000)))
    for pin, function in zip(pins, functions, strict=True):
        index = board.find_pin(pin)
        port, bit = base + 0x400 * (index // 16), index % 16
        assert board.read_word(port) >> (2 * bit) & 3 == 2
        assert board.read_word(port + 0x20 + bit // 8 * 4) >> (bit % 8 * 4) & 15 \
            == function
