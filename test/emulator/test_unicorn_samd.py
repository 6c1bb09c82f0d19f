# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware of SAM C21, D21, D51 and E51 on emulated chips."""

import firmware_matrix
import pytest
import unicorn_board
from step_runs import (
    assert_prompt,
    assert_switch_stops,
    expect_clocks,
    start_steps,
)
from test_unicorn import SMALL
from unicorn_board import UnicornBoard

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]

STEP, DIR, SWITCH, OUT, SENSOR = "PA12", "PA13", "PA14", "PA27", "PA2"
# configuration, chip, crystal; the console is on USB if its name says no other
CONFIGS = [("samd21g18", "samd21g18", 32768),
           ("samd21g18_serial", "samd21g18", 32768),
           ("samd21e15", "samd21e15", 32768), ("samc21g18", "samc21g18", 12000000),
           ("samd51p20_serial", "samd51p20", 25000000),
           ("same51j19", "same51j19", 32768)]
ON_UART = [CONFIGS[1], CONFIGS[3], CONFIGS[4]]
NAMES = "config, chip, crystal"
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


@pytest.mark.parametrize(NAMES, CONFIGS)
def test_from_reset_to_steps(config, chip, crystal, make_board):
    board = make_board(config, chip, crystal)
    constants = board.dictionary["config"]
    assert constants["MCU"] == chip + "a" and constants["ADC_MAX"] == 4095
    clock = board.query("get_clock", "clock")["clock"]
    assert 0 < board.clock - clock < 0.01 * board.freq
    configure(board)
    assert board.query("get_config", "config")["move_count"] > 50
    origin = start_steps(board, board.freq // 5000, 50, add=-3)
    board.run_for(0.1)
    edges = [c for c, _ in board.list_edges(board.find_pin(STEP), origin)]
    assert_prompt(edges, expect_clocks(origin, board.freq // 5000, 50, -3), PROMPT)
    assert board.query("stepper_get_position", "stepper_position",
                       oid=0)["pos"] == -50
    assert board.find_shutdown() is None
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
    pulse = board.freq // 500000
    configure(board, pulse, invert=0)
    origin = start_steps(board, board.freq // 20000, 40)
    board.run_for(0.1)
    edges = board.list_edges(board.find_pin(STEP), origin)
    rises = [c for c, level in edges if level]
    falls = [c for c, level in edges if not level]
    assert_prompt(rises, expect_clocks(origin, board.freq // 20000, 40), PROMPT)
    assert all(f - r >= pulse for r, f in zip(rises, falls, strict=True))


@pytest.mark.parametrize(NAMES, ON_UART)
def test_switch_stops_a_stepper(config, chip, crystal, make_board):
    board = make_board(config, chip, crystal)
    configure(board)
    assert_switch_stops(board, SWITCH, STEP)


@pytest.mark.parametrize(NAMES, ON_UART)
@pytest.mark.parametrize("pin", ["PA2", "PA11", "ADC_TEMPERATURE"])
def test_analog_input(config, chip, crystal, pin, make_board):
    board = make_board(config, chip, crystal)
    number = board.dictionary["enumerations"]["pin"].get(pin)
    if number is None and pin == "ADC_TEMPERATURE":
        pytest.skip("not with the converter of this chip")
    if number is None:
        number = board.find_pin(pin)
        board.analog[number] = 0x5678
    if pin == "PA11" and "PA11" in board.dictionary["config"]["RESERVE_PINS_serial"]:
        pytest.skip("the console's")
    board.configure(("config_analog_in", dict(oid=4, pin=number)))
    board.send("query_analog_in", oid=4, clock=(board.clock + board.freq // 10)
               % 2**32, sample_ticks=board.freq // 1000, sample_count=4,
               rest_ticks=board.freq // 10, bytes_per_report=2, min_value=0,
               max_value=65535, range_check_count=4)
    board.run_for(0.4)
    reports = board.list_messages("analog_in_state")
    value = int.from_bytes(reports[-1]["values"], "little")
    expected = 828 if pin == "ADC_TEMPERATURE" else 0x5678 >> 4
    assert len(reports) >= 2 and value == 4 * expected


@pytest.mark.parametrize(NAMES, [CONFIGS[1], CONFIGS[3]])
@pytest.mark.parametrize("cycle_time", [0.00005, 0.1])
@pytest.mark.parametrize("name", ["PA16", "PA20"])
def test_hardware_pwm(config, chip, crystal, cycle_time, name, make_board):
    board = make_board(config, chip, crystal)
    pin, cycle = board.find_pin(name), round(cycle_time * board.freq)
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
    """A device that answers with the complement, selected by a pin."""
    board = make_board(config, chip, crystal)
    select, seen = board.find_pin("PA20"), []

    def answer(data):
        seen.append((board.list_edges(select)[-1][1], data))
        return bytes(255 - byte for byte in data)

    board.spi_devices[1] = answer
    pins = assign_pins(1, tx="PA16", clk="PA17", rx="PA19")
    board.configure(
        *pins(board), ("config_spi", dict(oid=5, pin=select, cs_active_high=0)),
        ("spi_set_bus", dict(oid=5, spi_bus=1, mode=3,
                             rate=4000000)))
    got = board.query("spi_transfer", "spi_transfer_response", oid=5,
                      data=b"\x01\x80\xaa")
    assert got["response"] == b"\xfe\x7f\x55"
    assert seen == [(0, b"\x01"), (0, b"\x80"), (0, b"\xaa")]
    assert board.list_edges(select)[-1][1] == 1


@pytest.mark.parametrize(NAMES, ON_UART)
def test_i2c_bus(config, chip, crystal, make_board):
    """A memory behind a pointer; nobody at another address."""
    board, seen = make_board(config, chip, crystal), []

    def answer(data, n_read):
        if data:
            seen.append(data)
        return bytes(range(0x40, 0x40 + n_read))

    board.i2c_devices[3, 0x1C] = answer
    pins = assign_pins(3, tx="PA22", clk="PA23")
    board.configure(*pins(board), *[
        step for oid, addr in ((5, 0x1C), (6, 0x1D)) for step in (
            ("config_i2c", dict(oid=oid)),
            ("i2c_set_bus", dict(oid=oid, i2c_bus=3, rate=100000, address=addr)))])
    for n_read in (1, 2, 6, 40):
        got = board.query("i2c_transfer", "i2c_response", oid=5, write=b"\x07\x81",
                          read_len=n_read)
        assert got["i2c_bus_status"] == 0
        assert got["response"] == bytes(range(0x40, 0x40 + n_read))
    board.query("i2c_transfer", "i2c_response", oid=5, write=b"\x09", read_len=0)
    assert seen == [b"\x07\x81"] * 4 + [b"\x09"]
    for data, n_read in ((b"\x01", 0), (b"", 2), (b"", 0)):
        got = board.query("i2c_transfer", "i2c_response", oid=6, write=data,
                          read_len=n_read)
        assert got["i2c_bus_status"] == 2
    assert board.find_shutdown() is None


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
    board = make_board(config, chip, crystal)
    configure(board)
    start_steps(board, 1000, 60000)
    board.run_for(0.06)
    board.send("emergency_stop")
    stopped = board.list_messages("shutdown")[0]["#clock"]
    assert board.find_shutdown() == "Command request"
    assert board.list_edges(board.find_pin(OUT))[-1][1] == 1
    assert not board.list_edges(board.find_pin(STEP), stopped)
    assert board.query("get_uptime", "uptime")["clock"] > 0


@pytest.mark.parametrize(NAMES, ON_UART)
def test_watchdog_resets_a_hung_program(config, chip, crystal, make_board):
    """The vector of SysTick leads to `b .` in the stack's unused part."""
    board = make_board(config, chip, crystal)
    size = int(firmware_matrix.read_options(firmware_matrix.build(config))[
        "RAM_SIZE"], 0)
    place = 0x20000000 + size - 0x300
    board.send("debug_write", order=1, addr=place, val=0xE7FE)
    board.send("debug_write", order=2, addr=0x20000000 + 4 * 15, val=place + 1)
    begin = board.clock
    while not board.resets and board.clock < begin + 2 * board.freq:
        board.run_for(0.05)
    assert 0.2 < (board.resets[0] - begin) / board.freq < 1.1


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
