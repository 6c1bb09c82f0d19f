# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware of SAM C21, D21, D51 and E51 on emulated chips."""

import firmware_matrix
import pytest
import unicorn_board
from chip_checks import (
    Pins,
    check_defaults,
    check_i2c,
    check_pulses,
    check_pwm,
    check_spi,
    check_steps,
    configure,
    read_analog,
    time_to_reset,
)
from step_runs import assert_switch_stops
from test_unicorn import SMALL
from unicorn_board import UnicornBoard

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

PINS = Pins("PA12", "PA13", "PA14", "PA27", "PA2")
# configuration, chip, crystal; the console is on USB if its name says no other
CONFIGS = [("samd21g18", "samd21g18", 32768),
           ("samd21g18_serial", "samd21g18", 32768),
           ("samd21e15", "samd21e15", 32768), ("samc21g18", "samc21g18", 12000000),
           ("samd51p20_serial", "samd51p20", 25000000),
           ("same51j19", "same51j19", 32768)]
ON_UART = [CONFIGS[1], CONFIGS[3], CONFIGS[4]]
NAMES = "config, chip, crystal"
# What they show at 25 degC; the second one is a D51's
CHIP_SENSORS = {"ADC_TEMPERATURE": 828, "ADC_TEMPERATURE_CTAT": 869}
# From a timer's clock to the pin, in instructions; a C21 reads its clock slowly
PROMPT = 70


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def make_board(adapter, monkeypatch):
    """make_board(config, chip, crystal): a chip that runs and was identified."""
    def make(config, chip, crystal, out=None):
        out = out or firmware_matrix.build(config)
        unicorn_board.choose_chip(monkeypatch, out, chip, crystal)
        board = UnicornBoard(adapter)
        board.identify()
        return board
    return make


@pytest.mark.parametrize(NAMES, CONFIGS)
def test_from_reset_to_steps(config, chip, crystal, make_board):
    board = make_board(config, chip, crystal)
    constants = board.dictionary["config"]
    assert constants["MCU"] == chip + "a" and constants["ADC_MAX"] == 4095
    check_steps(board, PINS, PROMPT, 50)
    if "SERIAL_BAUD" not in constants:
        assert [board.usb_text(i) for i in (2, 3)] == [
            chip + "a", "4433221188776655CCBBAA9901FFEEDD"]


@pytest.mark.parametrize(NAMES, [CONFIGS[0], CONFIGS[5]])
def test_touch_starts_the_boot_loader(config, chip, crystal, make_board):
    """It finds its key in the last word of memory after the reset."""
    board = make_board(config, chip, crystal)
    size = int(firmware_matrix.read_options(firmware_matrix.build(config))[
        "RAM_SIZE"], 0)
    board.library.unicorn_usb_touch()
    board.run_for(0.1)
    key = 0xF01669EF if chip.startswith("same") else 0x07738135
    assert board.resets
    assert board.library.unicorn_peek(0x20000000 + size - 4) & 0xFFFFFFFF == key


@pytest.mark.parametrize(NAMES, ON_UART)
def test_pulses_keep_their_length(config, chip, crystal, make_board):
    board = make_board(config, chip, crystal)
    check_pulses(board, PINS, PROMPT, board.freq // 500000)


@pytest.mark.parametrize(NAMES, ON_UART)
def test_switch_stops_a_stepper(config, chip, crystal, make_board):
    board = make_board(config, chip, crystal)
    configure(board, PINS)
    assert_switch_stops(board, PINS.switch, PINS.step)


@pytest.mark.parametrize(NAMES, ON_UART)
@pytest.mark.parametrize("pin", ["PA2", "PA11", *CHIP_SENSORS])
def test_analog_input(config, chip, crystal, pin, make_board):
    board = make_board(config, chip, crystal)
    number = board.dictionary["enumerations"]["pin"].get(pin)
    if number is None and pin in CHIP_SENSORS:
        pytest.skip("not with the converter of this chip")
    if number is None:
        number = board.find_pin(pin)
        board.analog[number] = 0x5678
    if pin == "PA11" and "PA11" in board.dictionary["config"]["RESERVE_PINS_serial"]:
        pytest.skip("the console's")
    board.configure(("config_analog_in", dict(oid=4, pin=number)))
    assert board.dictionary["config"]["RESERVE_PINS_adc"] == "PA3"
    expected = CHIP_SENSORS.get(pin, 0x5678 >> 4)
    assert read_analog(board)[-1] == 4 * expected


@pytest.mark.parametrize(NAMES, [CONFIGS[1], CONFIGS[3]])
@pytest.mark.parametrize("cycle_time", [0.00005, 0.1])
@pytest.mark.parametrize("name", ["PA16", "PA20"])
def test_hardware_pwm(config, chip, crystal, cycle_time, name, make_board):
    check_pwm(make_board(config, chip, crystal), name, cycle_time)


def assign_pins(unit, **pins):
    """Commands that give a sercom its pins."""
    def make(board):
        types = board.dictionary["enumerations"]["sercom_pin_type"]
        return [("set_sercom_pin", dict(bus=unit, sercom_pin_type=types[role],
                                        pin=board.find_pin(pin)))
                for role, pin in pins.items()]
    return make


@pytest.mark.parametrize(NAMES, ON_UART)
def test_spi_bus(config, chip, crystal, make_board):
    board = make_board(config, chip, crystal)
    pins = assign_pins(1, tx="PA16", clk="PA17", rx="PA19")
    check_spi(board, 1, 1, "PA20", before=pins(board))


@pytest.mark.parametrize(NAMES, ON_UART)
def test_i2c_bus(config, chip, crystal, make_board):
    board = make_board(config, chip, crystal)
    pins = assign_pins(3, tx="PA22", clk="PA23")
    check_i2c(board, 3, 3, lengths=(1, 2, 6, 40),
              absent=((b"\x01", 0), (b"", 2), (b"", 0)), before=pins(board))


@pytest.mark.parametrize("bus, role, reason", [
    (1, 0, "Invalid SERCOM configuration"), (1, 3, "Invalid SERCOM configuration"),
    (20, 0, "Invalid SERCOM bus")])
def test_pins_that_a_sercom_has_not(make_board, bus, role, reason):
    board = make_board(*CONFIGS[1])
    board.send("allocate_oids", count=1)
    board.send("set_sercom_pin", bus=bus, sercom_pin_type=role,
               pin=board.find_pin("PA2"))
    assert board.find_shutdown() == reason


@pytest.mark.parametrize(NAMES, ON_UART)
def test_shutdown_puts_pins_to_their_defaults(config, chip, crystal, make_board):
    check_defaults(make_board(config, chip, crystal), PINS)


@pytest.mark.parametrize(NAMES, ON_UART)
def test_watchdog_resets_a_hung_program(config, chip, crystal, make_board):
    """The vector of SysTick leads to `b .` in the stack's unused part."""
    board = make_board(config, chip, crystal)
    size = int(firmware_matrix.read_options(firmware_matrix.build(config))[
        "RAM_SIZE"], 0)
    place = 0x20000000 + size - 0x300
    board.send("debug_write", order=1, addr=place, val=0xE7FE)
    board.send("debug_write", order=2, addr=0x20000000 + 4 * 15, val=place + 1)
    assert 0.2 < time_to_reset(board) < 1.1


@pytest.mark.slow
@pytest.mark.parametrize("config, chip, crystal, options", [
    ("samd21g18", "samd21g18", 0, ["CLOCK_REF_INTERNAL"]),
    ("samd21g18_serial", "samd21g18", 0, ["CLOCK_REF_INTERNAL",
                                          "SAMD_FLASH_START_0000"]),
    ("samc21g18", "samc21g18", 25000000, ["CLOCK_REF_X25M"]),
    ("same51j19", "same51j19", 0, ["CLOCK_REF_INTERNAL"]),
    ("same51j19", "same51j19", 25000000, ["CLOCK_REF_X25M", "SAMD51_FREQ_180"]),
    ("same51j19", "same51j19", 32768, ["SAMD51_FREQ_150"])])
def test_other_clocks(config, chip, crystal, options, make_board, tmp_path):
    """The models refuse a PLL, wait states or a baud rate out of bounds."""
    out = firmware_matrix.build(
        config, ("LOW_LEVEL_OPTIONS=y", *[o + "=y" for o in options], *SMALL),
        tmp_path / chip)
    chosen = firmware_matrix.read_options(out)
    assert all(chosen[o] == "y" for o in options)
    board = make_board(config, chip, crystal, out)
    assert board.query("get_config", "config")["is_config"] == 0
