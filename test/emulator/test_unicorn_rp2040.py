# SPDX-License-Identifier: GPL-3.0-or-later
"""The RP2040 firmware on an emulated chip: from the boot ROM to steps."""

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
from step_runs import assert_switch_stops, expect_clocks, start_steps
from test_unicorn import SMALL
from unicorn_board import UnicornBoard

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

PINS = Pins("gpio11", "gpio10", "gpio4", "gpio25", "gpio27")
CONFIG = "rp2040_serial"
CRYSTAL = 12000000
# From a timer's clock to the pin: ten instructions a tick
PROMPT = 8


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def make_board(adapter, monkeypatch):
    """make_board(config): a chip that runs and was identified."""
    def make(config=CONFIG, out=None):
        out = out or firmware_matrix.build(config)
        unicorn_board.choose_chip(monkeypatch, out, config[:6], CRYSTAL)
        board = UnicornBoard(adapter)
        board.identify()
        return board
    return make


def test_from_reset_to_steps(make_board):
    board = make_board()
    constants = board.dictionary["config"]
    assert constants["MCU"] == "rp2040" and constants["ADC_MAX"] == 4095
    assert constants["CLOCK_FREQ"] == 12000000
    assert constants["RESERVE_PINS_serial"] == "gpio1,gpio0"
    check_steps(board, PINS, PROMPT, 1000)


def test_console_on_usb(make_board):
    """The host enumerates the device, opens its port, and configures it."""
    board = make_board("rp2040")
    texts = [board.usb_text(i) for i in range(1, 4)]
    assert texts == ["Klipper", "rp2040", "E66138010203042F"]
    configure(board, PINS)
    origin = start_steps(board, board.freq // 5000, 50)
    board.run_for(0.1)
    assert len(board.list_edges(board.find_pin(PINS.step), origin)) == 50
    assert board.find_shutdown() is None


@pytest.mark.parametrize("chip", ["rp2040", "rp2350"])
def test_touch_starts_the_boot_loader(chip, make_board):
    board = make_board(chip)
    board.library.unicorn_usb_touch()
    board.run_for(0.1)
    assert board.resets and board.library.unicorn_wants_bootloader()


def test_pulses_keep_their_length(make_board):
    check_pulses(make_board(), PINS, PROMPT, 24)


def test_switch_stops_a_stepper(make_board):
    board = make_board()
    configure(board, PINS)
    assert_switch_stops(board, PINS.switch, PINS.step)


@pytest.mark.parametrize("pin, expected", [
    ("gpio26", 4 * (0x5678 >> 4)), ("ADC_TEMPERATURE", 4 * 876)])
def test_analog_input(pin, expected, make_board):
    board = make_board()
    number = board.dictionary["enumerations"]["pin"].get(pin)
    if number is None:
        number = board.find_pin(pin)
        board.analog[number] = 0x5678
    board.configure(("config_analog_in", dict(oid=4, pin=number)))
    assert read_analog(board)[-1] == expected


@pytest.mark.parametrize("cycle_time", [0.00005, 0.1])
def test_hardware_pwm(cycle_time, make_board):
    check_pwm(make_board(), "gpio19", cycle_time)


@pytest.mark.parametrize("bus, number", [
    ("spi0c", 0), ("spi1_gpio12_gpio15_gpio14", 1)])
def test_spi_bus(bus, number, make_board):
    board = make_board()
    buses = board.dictionary["enumerations"]["spi_bus"]
    check_spi(board, number, buses[bus], "gpio9")


@pytest.mark.parametrize("bus, number", [("i2c0e", 0), ("i2c1f", 1)])
def test_i2c_bus(bus, number, make_board):
    board = make_board()
    buses = board.dictionary["enumerations"]["i2c_bus"]
    check_i2c(board, number, buses[bus], lengths=(1, 2, 6, 40),
              absent=((b"\x01", 0), (b"", 2)))


def test_shutdown_puts_pins_to_their_defaults(make_board):
    check_defaults(make_board(), PINS, 200)


def test_shutdown_within_the_timer_interrupt(make_board):
    check_shutdown_in_interrupt(make_board(), PINS, 2)


def test_reset_command(make_board):
    board = make_board()
    board.send("reset")
    assert board.resets and not board.library.unicorn_wants_bootloader()


def test_watchdog_resets_a_hung_program(make_board):
    """The vector of the timer's interrupt leads to `b .` in unused memory."""
    board = make_board()
    board.send("debug_write", order=1, addr=0x20041000, val=0xE7FE)
    board.send("debug_write", order=2, addr=0x20000000 + 4 * 16, val=0x20041001)
    assert 0.4 < time_to_reset(board) < 0.6


@pytest.mark.slow
@pytest.mark.parametrize("option", [
    "RP2040_FLASH_GENERIC_03", "RPXXXX_FLASH_START_4000",
    "RPXXXX_SERIAL_UART1_PINS_20_21"])
def test_other_ways_to_start(option, make_board, tmp_path):
    out = firmware_matrix.build(
        CONFIG, ("LOW_LEVEL_OPTIONS=y", option + "=y", *SMALL), tmp_path / "rp2040")
    assert firmware_matrix.read_options(out)[option] == "y"
    board = make_board(out=out)
    assert board.query("get_config", "config")["is_config"] == 0
    name = "gpio21,gpio20" if "UART1" in option else "gpio1,gpio0"
    assert board.dictionary["config"]["RESERVE_PINS_serial"] == name


def test_uf2_holds_the_program():
    """Blocks of 256 bytes from the start of flash; the checksum's place."""
    out = firmware_matrix.build(CONFIG)
    blocks = (out / "klipper.uf2").read_bytes()
    image = (out / "klipper.bin").read_bytes()
    words = [int.from_bytes(blocks[i:i + 4], "little") for i in range(0, 32, 4)]
    assert words[2:4] == [0x2000, 0x10000000] and words[7] == 0xE48BFF56
    got = b"".join(blocks[i + 32:i + 32 + 256] for i in range(0, len(blocks), 512))
    assert got.startswith(image) and len(got) - len(image) < 256


@pytest.fixture
def rp2350(make_board):
    board = make_board("rp2350")
    assert board.dictionary["config"]["CLOCK_FREQ"] == 150000000
    assert [board.usb_text(i) for i in (2, 3)] == ["rp2350", "1122334455667788"]
    return board


@pytest.mark.parametrize("step", [PINS.step, "gpio40"])
def test_rp2350_steps(step, rp2350):
    """On pins of both banks."""
    pin = rp2350.find_pin
    rp2350.configure(
        ("config_stepper", dict(oid=0, step_pin=pin(step), dir_pin=pin("gpio41"),
                                invert_step=-1, step_pulse_ticks=0)),
        ("config_digital_out", dict(oid=1, pin=pin("gpio39"), value=0,
                                    default_value=1, max_duration=0)))
    origin = start_steps(rp2350, 30000, 50, add=-3)
    rp2350.run_for(0.1)
    edges = [c for c, _ in rp2350.list_edges(pin(step), origin)]
    late = [e - c for e, c in zip(edges, expect_clocks(origin, 30000, 50, -3),
                                  strict=True)]
    assert -60 <= min(late) and max(late) <= 60
    rp2350.send("emergency_stop")
    assert rp2350.list_edges(pin("gpio39"))[-1][1] == 1


def test_rp2350_peripherals(rp2350):
    """Converter, pwm of both halves of pins, SPI and I2C."""
    pin, freq = rp2350.find_pin, rp2350.freq
    top = rp2350.dictionary["config"]["PWM_MAX"]
    rp2350.analog[pin("gpio26")] = 0x5678
    rp2350.inputs[pin("gpio36")] = 1
    rp2350.spi_devices[1] = lambda data: bytes(255 - b for b in data)
    rp2350.i2c_devices[0, 0x1C] = lambda data, n: bytes(range(n))
    rp2350.configure(
        ("config_analog_in", dict(oid=0, pin=pin("gpio26"))),
        *[("config_pwm_out", dict(oid=oid, pin=pin(name), cycle_ticks=freq // 1000,
                                  value=top // 4, default_value=0, max_duration=0))
          for oid, name in ((1, "gpio19"), (2, "gpio45"))],
        ("config_spi_without_cs", dict(oid=3)),
        ("spi_set_bus", dict(oid=3, spi_bus=6, mode=0, rate=1000000)),
        ("config_i2c", dict(oid=4)),
        ("i2c_set_bus", dict(oid=4, i2c_bus=4, rate=100000, address=0x1C)))
    for _, at, ticks, on, whole in rp2350.pwm[-2:]:
        assert at in (pin("gpio19"), pin("gpio45"))
        assert ticks == pytest.approx(freq / 1000, rel=0.01)
        assert on / whole == pytest.approx(0.25, abs=0.001)
    assert rp2350.query("spi_transfer", "spi_transfer_response", oid=3,
                        data=b"\x01\x80")["response"] == b"\xfe\x7f"
    assert rp2350.query("i2c_transfer", "i2c_response", oid=4, write=b"\x07",
                        read_len=3)["response"] == b"\x00\x01\x02"
    rp2350.send("query_analog_in", oid=0, clock=(rp2350.clock + freq // 10) % 2**32,
                sample_ticks=freq // 1000, sample_count=4, rest_ticks=freq // 10,
                bytes_per_report=2, min_value=0, max_value=65535,
                range_check_count=4)
    rp2350.run_for(0.3)
    values = rp2350.list_messages("analog_in_state")[-1]["values"]
    assert int.from_bytes(values, "little") == 4 * (0x5678 >> 4)


def test_rp2350_watchdog(rp2350):
    rp2350.send("debug_write", order=1, addr=0x20081000, val=0xE7FE)
    rp2350.send("debug_write", order=2, addr=0x20000000 + 4 * 15, val=0x20081001)
    begin = rp2350.clock
    while not rp2350.resets and rp2350.clock < begin + 2 * rp2350.freq:
        rp2350.run_for(0.05)
    assert 0.4 < (rp2350.resets[0] - begin) / rp2350.freq < 0.6
