# SPDX-License-Identifier: GPL-3.0-or-later
"""The STM32 firmware on emulated chips: it boots, talks, steps and stops.

Chips are stepped by hand, message by message; edges are compared with the
clocks that were asked for.
"""

import firmware_matrix
import pytest
import unicorn_board
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


def start_steps(board, interval, count, add=0):
    """Queue one run; returns the clock from which it counts."""
    origin = board.clock + board.freq // 20
    board.send("reset_step_clock", oid=0, clock=origin % 2**32)
    board.send("queue_step", oid=0, interval=interval, count=count, add=add)
    return origin


def expect_clocks(origin, interval, count, add=0):
    clocks = []
    for _ in range(count):
        origin += interval
        clocks.append(origin)
        interval += add
    return clocks


def assert_prompt(edges, clocks):
    """Each edge comes at its clock, or as late as its event takes."""
    assert len(edges) == len(clocks)
    late = [edge - clock for edge, clock in zip(edges, clocks, strict=True)]
    assert -PROMPT <= min(late) and max(late) <= PROMPT, (min(late), max(late))


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
    assert_prompt(edges, expect_clocks(origin, board.freq // 5000, 50, -3))
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
    assert_prompt(rises, expect_clocks(origin, board.freq // 20000, 40))
    assert all(f - r >= pulse for r, f in zip(rises, falls, strict=True))


@pytest.mark.parametrize("chip", ["stm32f072", "stm32f103", "stm32f407",
                                  "stm32g431", "stm32h743"])
def test_switch_stops_a_stepper(chip, make_board):
    board = make_board(chip)
    configure(board)
    origin = start_steps(board, board.freq // 1000, 200)
    hit = origin + board.freq // 10
    board.inputs[board.find_pin(SWITCH)] = lambda clock: clock >= hit
    board.send("trsync_start", oid=2, report_clock=0, report_ticks=0,
               expire_reason=4)
    board.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    board.send("endstop_home", oid=1, clock=(origin + 10) % 2**32,
               sample_ticks=board.freq // 100000, sample_count=4,
               rest_ticks=board.freq // 20000, pin_value=1, trsync_oid=2,
               trigger_reason=1)
    board.run_for(0.3)
    states = board.list_messages("trsync_state")
    assert states and states[-1]["trigger_reason"] == 1
    steps = board.list_edges(board.find_pin(STEP), origin)
    assert hit - steps[-1][0] < board.freq // 1000
    assert steps[-1][0] < hit + board.freq // 10000


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


@pytest.mark.parametrize("chip, single, burst", [
    ("stm32f070", 115, 70), ("stm32f103", 75, 56), ("stm32f407", 75, 56)])
def test_instructions_of_a_step(chip, single, burst, make_board):
    """A step by itself, from entry to return; and in an endless row."""
    board = make_board(chip)
    configure(board)
    start_steps(board, board.freq // 2000, 400)
    board.run_for(0.06)
    _, irqs_before, single_before = board.read_stats()
    board.run_for(0.1)
    _, n_irqs, n_single = board.read_stats()
    n_irqs, n_single = n_irqs - irqs_before, n_single - single_before
    assert n_irqs >= 199
    board.run_for(0.1)
    begin = len(board.edges)
    start_steps(board, burst, 60000)
    board.run_for(0.1 + burst * 60000 / board.freq)
    print("%s: %.1f instructions a step, at most %d in a row"
          % (chip, n_single / n_irqs, burst))
    assert n_single / n_irqs < single
    assert len(board.edges) - begin == 60000 and board.find_shutdown() is None
