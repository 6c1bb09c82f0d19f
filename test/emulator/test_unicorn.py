# SPDX-License-Identifier: GPL-3.0-or-later
"""The STM32 firmware on emulated chips: it boots, talks, steps and stops.

Chips are stepped by hand, message by message; edges are compared with the
clocks that were asked for.
"""

import firmware_matrix
import pytest
import unicorn_board
from step_runs import (
    assert_prompt,
    assert_switch_stops,
    expect_clocks,
    start_steps,
)
from unicorn_board import UnicornBoard

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

CHIPS = [name for name in firmware_matrix.CONFIGS if name.startswith("stm32")]
STEP, DIR, SWITCH, OUT, SENSOR = "PB0", "PB1", "PB3", "PB4", "PA4"
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


def configure(board, step_pulse_ticks=0, invert=-1):
    pin = board.find_pin
    board.configure(
        ("config_stepper", dict(oid=0, step_pin=pin(STEP), dir_pin=pin(DIR),
                                invert_step=invert,
                                step_pulse_ticks=step_pulse_ticks)),
        ("config_endstop", dict(oid=1, pin=pin(SWITCH), pull_up=1)),
        ("config_trsync", dict(oid=2)),
        ("config_digital_out", dict(oid=3, pin=pin(OUT), value=0,
                                    default_value=1, max_duration=0)),
        ("config_analog_in", dict(oid=4, pin=pin(SENSOR))))


@pytest.mark.parametrize("chip", CHIPS)
def test_chip_from_reset_to_steps(chip, make_board):
    board = make_board(chip)
    constants = board.dictionary["config"]
    assert constants["MCU"].startswith(chip) and constants["ADC_MAX"] == 4095
    clock = board.query("get_clock", "clock")["clock"]
    assert 0 < board.clock - clock < 0.01 * board.freq
    configure(board)
    count = board.query("get_config", "config")["move_count"]
    assert count > 100
    origin = start_steps(board, board.freq // 5000, 50, add=-3)
    board.run_for(0.1)
    edges = [c for c, _ in board.list_edges(board.find_pin(STEP), origin)]
    assert_prompt(edges, expect_clocks(origin, board.freq // 5000, 50, -3), PROMPT)
    assert board.query("stepper_get_position", "stepper_position",
                       oid=0)["pos"] == -50
    assert board.find_shutdown() is None


@pytest.mark.parametrize("chip", ["stm32f070", "stm32f103", "stm32f446"])
def test_pulses_keep_their_length(chip, make_board):
    board = make_board(chip)
    pulse = board.freq // 500000
    configure(board, pulse, invert=0)
    origin = start_steps(board, board.freq // 20000, 40)
    board.run_for(0.1)
    edges = board.list_edges(board.find_pin(STEP), origin)
    rises = [c for c, level in edges if level]
    falls = [c for c, level in edges if not level]
    assert_prompt(rises, expect_clocks(origin, board.freq // 20000, 40), PROMPT)
    assert all(f - r >= pulse for r, f in zip(rises, falls, strict=True))


@pytest.mark.parametrize("chip", ["stm32f072", "stm32f103", "stm32f407",
                                  "stm32g431", "stm32h743"])
def test_switch_stops_a_stepper(chip, make_board):
    board = make_board(chip)
    configure(board)
    assert_switch_stops(board, SWITCH, STEP)


@pytest.mark.parametrize("chip", CHIPS)
def test_analog_input(chip, make_board):
    board = make_board(chip)
    configure(board)
    board.analog[board.find_pin(SENSOR)] = 0x5678
    board.send("query_analog_in", oid=4, clock=(board.clock + board.freq // 10)
               % 2**32, sample_ticks=board.freq // 1000, sample_count=4,
               rest_ticks=board.freq // 10, bytes_per_report=2, min_value=0,
               max_value=65535,
               range_check_count=4)
    board.run_for(0.4)
    reports = board.list_messages("analog_in_state")
    value = int.from_bytes(reports[-1]["values"], "little")
    assert len(reports) >= 2 and value == 4 * (0x5678 >> 4)


@pytest.mark.parametrize("chip", [
    "stm32f070", "stm32f072", "stm32f103", "stm32f401", "stm32f407", "stm32g0b1",
    "stm32g431", "stm32h743", "stm32l412"])
@pytest.mark.parametrize("cycle_time", [0.00005, 0.1])
def test_hardware_pwm(chip, cycle_time, make_board):
    board = make_board(chip)
    pin, cycle = board.find_pin("PB8"), round(cycle_time * board.freq)
    top = board.dictionary["config"]["PWM_MAX"]
    board.configure(("config_pwm_out", dict(
        oid=5, pin=pin, cycle_ticks=cycle, value=0, default_value=top,
        max_duration=0)))
    for value in (top // 4, top, 0):
        board.send("queue_pwm_out", oid=5, value=value,
                   clock=(board.clock + board.freq // 20) % 2**32)
        board.run_for(0.1)
        _, at, ticks, on, whole = board.pwm[-1]
        assert at == pin and ticks == pytest.approx(cycle, rel=0.01)
        assert on / whole == pytest.approx(value / top, abs=0.001)
    board.send("emergency_stop")
    assert board.pwm[-1][3] == board.pwm[-1][4]


@pytest.mark.parametrize("chip", ["stm32f072", "stm32f103", "stm32f407",
                                  "stm32f765", "stm32g431", "stm32h743"])
def test_spi_bus(chip, make_board):
    """A device that answers with the complement, selected by a pin."""
    board = make_board(chip)
    pins = board.dictionary["enumerations"]["spi_bus"]
    select, seen = board.find_pin("PB12"), []

    def answer(data):
        seen.append((board.list_edges(select)[-1][1], data))
        return bytes(255 - byte for byte in data)

    board.spi_devices[1] = answer
    board.configure(
        ("config_spi", dict(oid=5, pin=select, cs_active_high=0)),
        ("spi_set_bus", dict(oid=5, spi_bus=pins["spi1"], mode=3, rate=4000000)))
    got = board.query("spi_transfer", "spi_transfer_response", oid=5,
                      data=b"\x01\x80\xaa")
    assert got["response"] == b"\xfe\x7f\x55"
    assert seen == [(0, b"\x01"), (0, b"\x80"), (0, b"\xaa")]
    assert board.list_edges(select)[-1][1] == 1


@pytest.mark.parametrize("chip, bus", [
    ("stm32f072", "i2c1"), ("stm32f103", "i2c1a"), ("stm32f407", "i2c2"),
    ("stm32f765", "i2c1"), ("stm32g0b1", "i2c2_PB13_PB14"),
    ("stm32g431", "i2c1_PB8_PB9"), ("stm32h743", "i2c1"), ("stm32l412", "i2c1")])
def test_i2c_bus(chip, bus, make_board):
    """A memory behind a pointer; nobody at another address."""
    board = make_board(chip)
    seen, number = [], 2 if "i2c2" in bus else 1

    def answer(data, n_read):
        if data:
            seen.append(data)
        return bytes(range(0x40, 0x40 + n_read))

    board.i2c_devices[number, 0x1C] = answer
    buses = board.dictionary["enumerations"]["i2c_bus"]
    board.configure(*[step for oid, addr in ((5, 0x1C), (6, 0x1D)) for step in (
        ("config_i2c", dict(oid=oid)),
        ("i2c_set_bus", dict(oid=oid, i2c_bus=buses[bus], rate=100000,
                             address=addr)))])
    for n_read in (1, 2, 3, 6):
        got = board.query("i2c_transfer", "i2c_response", oid=5, write=b"\x07\x81",
                          read_len=n_read)
        assert got["i2c_bus_status"] == 0
        assert got["response"] == bytes(range(0x40, 0x40 + n_read))
    board.query("i2c_transfer", "i2c_response", oid=5, write=b"\x09", read_len=0)
    assert seen == [b"\x07\x81"] * 4 + [b"\x09"]
    got = board.query("i2c_transfer", "i2c_response", oid=6, write=b"\x01",
                      read_len=0)
    assert got["i2c_bus_status"] == 2
    assert board.find_shutdown() is None


@pytest.mark.parametrize("chip", ["stm32f070", "stm32f103", "stm32f407",
                                  "stm32g0b1", "stm32h723"])
def test_shutdown_puts_pins_to_their_defaults(chip, make_board):
    board = make_board(chip)
    configure(board)
    start_steps(board, 1000, 60000)
    board.run_for(0.06)
    board.send("emergency_stop")
    stopped = board.list_messages("shutdown")[0]["#clock"]
    assert board.find_shutdown() == "Command request"
    assert board.list_edges(board.find_pin(OUT))[-1][1] == 1
    assert not board.list_edges(board.find_pin(STEP), stopped)
    # it left the interrupt, if it was in one: everything goes on
    assert board.query("get_uptime", "uptime")["clock"] > 0
    board.send("clear_shutdown")
    assert board.query("get_config", "config")["is_shutdown"] == 0


@pytest.mark.parametrize("chip", ["stm32f070", "stm32f103", "stm32f407"])
def test_shutdown_within_the_timer_interrupt(chip, make_board):
    board = make_board(chip)
    configure(board)
    # more steps than the chip can make
    start_steps(board, 10, 60000)
    board.run_for(0.1)
    assert board.find_shutdown() == "Rescheduled timer in the past"
    clock = board.query("get_clock", "clock")["clock"]
    board.run_for(0.5)
    assert board.query("get_clock", "clock")["clock"] > clock
    assert not board.resets


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
    begin = board.clock
    while not board.resets and board.clock < begin + 2 * board.freq:
        board.run_for(0.05)
    assert 0.2 < (board.resets[0] - begin) / board.freq < 1.1


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
