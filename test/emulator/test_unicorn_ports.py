# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware of LPC176x and SAM on emulated chips: it boots, talks, steps, stops."""

import struct

import firmware_matrix
import pytest
import unicorn_board
from chip_checks import (
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
from port_chips import CHIPS, NAMES
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

# From a timer's clock to the pin, in instructions
PROMPT = 60
SYSTICK = 15
# A pin that has a name on the largest package only
MISSING = {"lpc1": ("P0.0", 12), "sam3": ("PA0", 31)}


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def make_board(adapter, monkeypatch):
    """make_board(name, out): a chip that runs and was identified."""
    def make(name, out=None):
        out = out or firmware_matrix.build(name)
        unicorn_board.choose_chip(monkeypatch, out, name, CHIPS[name].crystal)
        board = UnicornBoard(adapter)
        board.identify()
        return board
    return make


def find_bus(board, kind, name):
    """Number of a bus; the dictionary may name the first of several."""
    buses = board.dictionary["enumerations"][kind]
    if name in buses and not isinstance(buses[name], list):
        return buses[name]
    first = next(key for key in buses if key[:-1] == name[:-1]
                 and isinstance(buses[key], list))
    number = buses[first][0] + int(name[-1]) - int(first[-1])
    assert number < sum(buses[first])
    return number


@pytest.mark.parametrize("name", NAMES)
def test_chip_from_reset_to_steps(name, make_board):
    board = make_board(name)
    constants = board.dictionary["config"]
    assert constants["MCU"] == name and constants["ADC_MAX"] == 4095
    has_shared = name[:4] in ("sam4", "same")
    assert constants.get("RESERVE_PINS_crystal") == ("PB8,PB9" if has_shared else None)
    check_steps(board, CHIPS[name], PROMPT, 1000)


# What hosts read: maker, chip, its number in the emulator
SAM_ID = b"SAM4 emulated id".hex().upper()
USB = {"lpc1768": ["Klipper", "lpc1768", "030405060708090A0B0C0D0E0F101112"],
       **{name: ["Klipper", name, SAM_ID] for name in NAMES if name[0] == "s"}}


@pytest.mark.parametrize("name", USB)
def test_console_on_usb(name, make_board):
    """The host enumerates the device, opens its port, and fills it."""
    board = make_board(name)
    assert [board.usb_text(i) for i in range(1, 4)] == USB[name]
    assert "RESERVE_PINS_serial" not in board.dictionary["config"]
    for i in range(40):
        assert board.query("debug_read", "debug_result", order=2,
                           addr=CHIPS[name].debug_ram + i // 8 * 4)["val"] >= 0
    assert board.find_shutdown() is None


@pytest.mark.parametrize("name", USB)
def test_touch_starts_the_boot_loader(name, make_board):
    """The watchdog of an LPC176x bites, which its boot loader takes for the wish;
    a SAM4 starts its ROM the next time."""
    board = make_board(name)
    begin = board.clock
    board.library.unicorn_usb_touch()
    board.run_for(0.1)
    assert board.resets and board.resets[0] - begin < 0.01 * board.freq
    assert board.library.unicorn_wants_bootloader() == (name[0] == "s")


UARTS = [("lpc1768", "LPC_SERIAL_UART0_P03_P02", "P0.3,P0.2", 0),
         ("same70q20b", "ATSAM_SERIAL_UART0", "PA9,PA10", 0x400000)]


@pytest.mark.parametrize("name, option, pins, start", UARTS)
def test_console_on_uarts(name, option, pins, start, make_board, tmp_path):
    """The LPC1768 without a boot loader: its ROM wants a sum in the vectors."""
    out = firmware_matrix.build(
        name, ("LOW_LEVEL_OPTIONS=y", option + "=y", "LPC_FLASH_START_0000=y",
               "WANT_ADXL345=n", "WANT_HX71X=n", "WANT_LDC1612=n",
               "WANT_SENSOR_ANGLE=n"), tmp_path / "out")
    options = firmware_matrix.read_options(out)
    assert int(options["FLASH_APPLICATION_ADDRESS"], 0) == start
    vectors = struct.unpack("<8I", (out / "klipper.bin").read_bytes()[:32])
    assert name != "lpc1768" or sum(vectors) % 2**32 == 0
    board = make_board(name, out)
    assert board.dictionary["config"]["RESERVE_PINS_serial"] == pins
    configure(board, CHIPS[name])
    origin = start_steps(board, board.freq // 2000, 50)
    board.run_for(0.1)
    edges = [c for c, _ in board.list_edges(board.find_pin(CHIPS[name].step), origin)]
    assert_prompt(edges, expect_clocks(origin, board.freq // 2000, 50), PROMPT)


@pytest.mark.parametrize("name", NAMES)
def test_pulses_keep_their_length(name, make_board):
    board = make_board(name)
    check_pulses(board, CHIPS[name], PROMPT, board.freq // 500000)


@pytest.mark.parametrize("name", NAMES)
def test_switch_stops_a_stepper(name, make_board):
    board, chip = make_board(name), CHIPS[name]
    configure(board, CHIPS[name])
    assert_switch_stops(board, chip.switch, chip.step)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("pull", [0, 1])
def test_open_input_shows_its_pull(name, pull, make_board):
    board = make_board(name)
    board.configure(("config_endstop", dict(
        oid=1, pin=board.find_pin(CHIPS[name].switch), pull_up=pull)))
    state = board.query("endstop_query_state", "endstop_state", oid=1)
    assert state["pin_value"] == pull


@pytest.mark.parametrize("name", NAMES)
def test_analog_input(name, make_board):
    board = make_board(name)
    configure(board, CHIPS[name])
    board.analog[board.find_pin(CHIPS[name].sensor)] = 0x5678
    assert read_analog(board)[-1] == 4 * (0x5678 >> 4)


@pytest.mark.parametrize("name", NAMES)
def test_two_analog_inputs_share_the_converter(name, make_board):
    board, chip = make_board(name), CHIPS[name]
    other = "P0.25" if name[0] == "l" else "PA3" if name[:4] == "sam3" else "PA18"
    configure(board, CHIPS[name], more=[
        ("config_analog_in", dict(oid=5, pin=board.find_pin(other)))])
    board.analog[board.find_pin(chip.sensor)] = 0x1110
    board.analog[board.find_pin(other)] = 0x2220
    at = (board.clock + board.freq // 10) % 2**32
    for oid in (4, 5):
        board.send("query_analog_in", oid=oid, clock=at,
                   sample_ticks=board.freq // 1000, sample_count=8,
                   rest_ticks=board.freq // 10, bytes_per_report=2, min_value=0,
                   max_value=65535, range_check_count=4)
    board.run_for(0.5)
    values = {(r["oid"], int.from_bytes(r["values"], "little"))
              for r in board.list_messages("analog_in_state")}
    assert values == {(4, 8 * 0x111), (5, 8 * 0x222)}


@pytest.mark.parametrize("name", ["lpc1768"])
def test_wild_reading_is_dropped(name, make_board):
    """Each third conversion is far off; the median of three never is."""
    board = make_board(name)
    configure(board, CHIPS[name])
    n_read = []

    def convert(clock):
        n_read.append(clock)
        return 0xFFF0 if len(n_read) % 3 == 1 else 0x4000

    board.analog[board.find_pin(CHIPS[name].sensor)] = convert
    assert set(read_analog(board)) == {4 * 0x400}
    assert len(n_read) >= 24


@pytest.mark.parametrize("name", [n for n in NAMES if CHIPS[n].pwm])
@pytest.mark.parametrize("cycle_time", [0.00005, 0.1])
def test_hardware_pwm(name, cycle_time, make_board):
    check_pwm(make_board(name), CHIPS[name].pwm, cycle_time)


@pytest.mark.parametrize("name", [n for n in NAMES if n.startswith("lpc")])
def test_pwm_channels_share_their_cycle_time(name, make_board):
    board = make_board(name)
    pins = [board.find_pin(pin) for pin in ("P2.4", "P1.18", "P3.26")]
    config = dict(value=0, default_value=0, max_duration=0)
    board.configure(*[("config_pwm_out", dict(
        config, oid=oid, pin=pin, cycle_ticks=10000 if oid < 2 else 20000))
        for oid, pin in enumerate(pins)])
    assert board.find_shutdown() == "PWM already programmed at different speed"
    assert {entry[1] for entry in board.pwm} == set(pins[:2])


@pytest.mark.parametrize("name, bus, number", [
    (name, *bus) for name in NAMES for bus in CHIPS[name].spi])
def test_spi_bus(name, bus, number, make_board):
    board = make_board(name)
    check_spi(board, number, find_bus(board, "spi_bus", bus), CHIPS[name].select)
    assert "BUS_PINS_" + bus in board.dictionary["config"]


@pytest.mark.parametrize("name, bus, number", [
    (name, *bus) for name in NAMES for bus in CHIPS[name].i2c])
def test_i2c_bus(name, bus, number, make_board):
    board = make_board(name)
    check_i2c(board, number, find_bus(board, "i2c_bus", bus))


@pytest.mark.parametrize("name", NAMES)
def test_shutdown_puts_pins_to_their_defaults(name, make_board):
    check_defaults(make_board(name), CHIPS[name])


@pytest.mark.parametrize("name", NAMES)
def test_shutdown_within_the_timer_interrupt(name, make_board):
    check_shutdown_in_interrupt(make_board(name), CHIPS[name], 10)


@pytest.mark.parametrize("name", NAMES)
def test_reset_command(name, make_board):
    board = make_board(name)
    board.send("reset")
    assert board.resets


@pytest.mark.parametrize("name", ["lpc1768", "sam3x8e", "same70q20b"])
def test_watchdog_resets_a_hung_program(name, make_board):
    """The timer's interrupt never ends: `b .` in the stack's unused part."""
    board, place = make_board(name), CHIPS[name].debug_ram
    vectors = board.read_word(0xE000ED08)
    assert board.read_word(vectors + 4 * SYSTICK) & 1
    board.send("debug_write", order=1, addr=place, val=0xE7FE)
    board.send("debug_write", order=2, addr=vectors + 4 * SYSTICK, val=place | 1)
    assert 0.2 < time_to_reset(board) < 1.1


# What silicon would not take: register, value, what the emulator says
FAULTS = [
    ("lpc1768", 0x40034000, 0x200000, "has no clock"),
    ("lpc1768", 0x400FC000, 0x303A, "4 clocks a fetch"),
    ("lpc1768", 0x400FC1A8, 0x55515154, "PCLKSEL changed while PLL0 is on"),
    ("lpc1768", 0x400FC08C, 0x55, "PLL0 fed"),
    ("sam3x8e", 0x400C0000, 1, "has no clock"),
    ("sam3x8e", 0x400E0A00, 0x300, "3 wait states"),
    ("sam3x8e", 0x400E0620, 0, "without its key"),
    ("sam3x8e", 0x400E0628, 0x200D3F01, "PLL changed while it is in use"),
    ("sam3x8e", 0x400E1A54, 0x8000, "written twice"),
    ("sam3x8e", 0x400E0E74, 1, "no register at 0x74"),
    ("sam4e8e", 0x400E0A04, 0x5A00000E, "by a program in flash"),
    ("same70q20b", 0x400E0630, 2, "peripherals at 300000000 Hz")]


@pytest.mark.parametrize("name, addr, value, message", FAULTS)
def test_faults_stop_the_emulator(name, addr, value, message, make_board, capfd):
    board = make_board(name)
    board.send("debug_write", order=2, addr=addr, val=value)
    with pytest.raises(AssertionError):
        board.query("get_clock", "clock")
    assert message in capfd.readouterr().err


@pytest.mark.parametrize("name", NAMES)
def test_no_such_pin(name, make_board):
    board = make_board(name)
    pins = board.dictionary["enumerations"]["pin"]
    first, bit = MISSING.get(name[:4], ("PB0", 15))
    number = pins[first][0] + bit
    board.send("allocate_oids", count=1)
    board.send("config_digital_out", oid=0, pin=number, value=0, default_value=0,
               max_duration=0)
    assert board.find_shutdown() == "Not an output pin"
