# SPDX-License-Identifier: GPL-3.0-or-later
"""The PRU firmware, executed: it boots, talks, steps, stops and prints."""

import re
import subprocess

import firmware_matrix
import lateness
import machine_configs
import pru_board
import pytest
from chip_checks import Pins, configure
from judge import Judge
from printer_run import PrinterRun
from pru_bench import MOTORS
from pru_board import PruBoard
from step_runs import assert_switch_stops, expect_clocks, start_steps
from test_exact_steps import cut_sample

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(pru_board.why_not()),
                                 reason=pru_board.why_not())]

PINS = Pins("gpio0_30", "gpio1_28", "gpio0_31", "gpio1_16", "AIN3")
PROMPT = 400            # cycles from a timer's clock to its pin: 2 us
IDLE_PROMPT = 500      # the same, beside tasks
CODE_SIZE = 8192        # bytes, of each core


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return pru_board.build_adapter(tmp_path_factory.mktemp("pru"))


@pytest.fixture
def board(adapter, monkeypatch):
    pru_board.choose_chip(monkeypatch, firmware_matrix.build("pru"))
    board = PruBoard(adapter)
    board.identify()
    return board


N_LINES = 30            # of the file that is printed


def test_programs_fit_their_cores():
    out = firmware_matrix.build("pru")
    prefix = firmware_matrix.find_prefix("pru")
    for core in "01":
        table = subprocess.run(
            [prefix + "objdump", "-h", str(out / ("pru%s.elf" % (core,)))],
            capture_output=True, text=True, check=True).stdout
        size = int(re.search(r"\.text\s+([0-9a-f]+)", table).group(1), 16)
        print("pru%s: %d bytes of code" % (core, size))
        assert 0 < size <= CODE_SIZE


def test_from_reset_to_steps(board):
    constants = board.dictionary["config"]
    assert constants["STEP_LATENCY_TICKS"] >= IDLE_PROMPT
    assert constants["MCU"] == "pru" and constants["ADC_MAX"] == 4095
    assert constants["CLOCK_FREQ"] == 200000000
    clock = board.query("get_clock", "clock")["clock"]
    assert 0 < board.clock - clock < 0.01 * board.freq
    configure(board, PINS, pull_up=0)
    assert board.query("get_config", "config")["move_count"] > 300
    origin = start_steps(board, board.freq // 5000, 50, add=-3)
    board.run_for(0.1)
    edges = [c for c, _ in board.list_edges(board.find_pin(PINS.step), origin)]
    clocks = expect_clocks(origin, board.freq // 5000, 50, -3)
    late = [edge - clock for edge, clock in zip(edges, clocks, strict=True)]
    assert 0 <= min(late) and max(late) < PROMPT
    assert board.query("stepper_get_position", "stepper_position",
                       oid=0)["pos"] == -50
    assert board.find_shutdown() is None


@pytest.mark.parametrize("late", ["PRU0_DELAY", "PRU1_DELAY"])
def test_one_core_starts_before_the_other(late, adapter, monkeypatch):
    monkeypatch.setenv(late, "1000000")
    pru_board.choose_chip(monkeypatch, firmware_matrix.build("pru"))
    board = PruBoard(adapter)
    board.run_for(0.01)
    board.identify()
    configure(board, PINS, pull_up=0)
    assert board.query("get_config", "config")["is_config"] == 1


def test_pulses_keep_their_length(board):
    pulse = board.freq // 500000
    configure(board, PINS, pulse, invert=0, pull_up=0)
    origin = start_steps(board, board.freq // 20000, 40)
    board.run_for(0.1)
    edges = board.list_edges(board.find_pin(PINS.step), origin)
    rises = [c for c, level in edges if level]
    falls = [c for c, level in edges if not level]
    late = [edge - clock for edge, clock in zip(
        rises, expect_clocks(origin, board.freq // 20000, 40), strict=True)]
    assert 0 <= min(late) and max(late) < PROMPT
    assert all(f - r >= pulse for r, f in zip(rises, falls, strict=True))


def test_steps_beside_commands(board):
    """Each command holds up timers for as long as it takes: blocks come every 2 ms,
    steps do so at ever other times before and behind them."""
    configure(board, PINS, pull_up=0)
    interval = board.freq // 10000 + 37
    origin = start_steps(board, interval, 2000)
    while board.clock < origin + 2000 * interval:
        board.send("get_config")
        board.send("stepper_get_position", oid=0)
        board.send("endstop_query_state", oid=1)
    board.run_for(0.001)
    edges = [c for c, _ in board.list_edges(board.find_pin(PINS.step), origin)]
    clocks = expect_clocks(origin, interval, 2000)
    late = [edge - clock for edge, clock in zip(edges, clocks, strict=True)]
    print("at most %d cycles late" % (max(late),))
    assert 0 <= min(late) and max(late) < IDLE_PROMPT


def test_switch_stops_a_stepper(board):
    configure(board, PINS, pull_up=0)
    assert_switch_stops(board, PINS.switch, PINS.step)


@pytest.mark.parametrize("n_motors, interval", [(1, 120), (3, 470)])
def test_fastest_steps(board, n_motors, interval):
    """Cycles from step to step, each within 25 us; docs/internals/firmware_speed.md
    has the least."""
    count = 20000
    pins = [(board.find_pin(s), board.find_pin(d)) for s, d in MOTORS[:n_motors]]
    board.configure(*(("config_stepper", dict(
        oid=oid, step_pin=step, dir_pin=direction, invert_step=-1,
        step_pulse_ticks=0)) for oid, (step, direction) in enumerate(pins)))
    origin = board.clock + board.freq // 20
    for oid in range(n_motors):
        board.send("reset_step_clock", oid=oid, clock=origin % 2**32)
        board.send("queue_step", oid=oid, interval=interval, count=count, add=0)
    board.run_for(0.06 + count * interval / board.freq)
    assert board.find_shutdown() is None
    for step, _ in pins:
        edges = [c for c, _ in board.list_edges(step, origin)]
        late = [edge - clock for edge, clock in zip(
            edges, expect_clocks(origin, interval, count), strict=True)]
        assert 0 <= min(late) and max(late) <= 25 * board.freq // 1000000


def test_software_pwm(board):
    configure(board, PINS, pull_up=0)
    cycle = board.freq // 100
    board.send("set_digital_out_pwm_cycle", oid=3, cycle_ticks=cycle)
    start = board.clock + board.freq // 20
    board.send("queue_digital_out", oid=3, clock=start % 2**32, on_ticks=cycle // 4)
    board.run_for(0.3)
    edges = board.list_edges(board.find_pin(PINS.out), start)
    assert [level for _, level in edges[:4]] == [1, 0, 1, 0]
    for clock, level in edges:
        due = start + (clock - start) // cycle * cycle + (0 if level else cycle // 4)
        assert 0 <= clock - due < PROMPT


def read_analog(board, seconds):
    """Readings that arrive meanwhile."""
    seen = len(board.list_messages("analog_in_state"))
    board.run_for(seconds)
    return [int.from_bytes(m["values"], "little")
            for m in board.list_messages("analog_in_state")[seen:]]


def test_converter_that_stands_still(board):
    """What is no longer measured is not told again as if it were new."""
    configure(board, PINS, pull_up=0)
    board.analog[board.find_pin(PINS.sensor)] = 0x5678
    board.send("query_analog_in", oid=4,
               clock=(board.clock + board.freq // 10) % 2**32,
               sample_ticks=board.freq // 1000, sample_count=4,
               rest_ticks=board.freq // 20, bytes_per_report=2, min_value=0,
               max_value=65535, range_check_count=4)
    assert len(read_analog(board, 0.3)) >= 3
    board.library.pru_stop_converter()
    read_analog(board, 0.1)
    assert read_analog(board, 0.3) == []
    assert board.find_shutdown() is None


def test_analog_input(board):
    configure(board, PINS, pull_up=0)
    board.analog[board.find_pin(PINS.sensor)] = 0x5678
    board.send("query_analog_in", oid=4,
               clock=(board.clock + board.freq // 10) % 2**32,
               sample_ticks=board.freq // 1000, sample_count=4,
               rest_ticks=board.freq // 10, bytes_per_report=2, min_value=0,
               max_value=65535, range_check_count=4)
    board.run_for(0.4)
    reports = board.list_messages("analog_in_state")
    value = int.from_bytes(reports[-1]["values"], "little")
    assert len(reports) >= 2 and value == 4 * (0x5678 >> 4)


def test_shutdown_puts_pins_to_their_defaults(board):
    configure(board, PINS, pull_up=0)
    start_steps(board, 4000, 60000)
    board.run_for(0.06)
    board.send("emergency_stop")
    stopped = board.list_messages("shutdown")[0]["#clock"]
    assert board.find_shutdown() == "Command request"
    assert board.list_edges(board.find_pin(PINS.out))[-1][1] == 1
    assert not board.list_edges(board.find_pin(PINS.step), stopped)
    board.send("config_reset")
    assert board.query("get_config", "config")["is_config"] == 0
    board.send("clear_shutdown")
    configure(board, PINS, pull_up=0)
    assert board.query("get_config", "config")["is_config"] == 1


def test_more_steps_than_it_can_make(board):
    configure(board, PINS, pull_up=0)
    start_steps(board, 20, 60000)
    board.run_for(0.1)
    assert board.find_shutdown() == "Rescheduled timer in the past"
    clock = board.query("get_clock", "clock")["clock"]
    board.run_for(0.1)
    assert board.query("get_clock", "clock")["clock"] > clock


@pytest.mark.parametrize("payload, reason", [
    (b"\x7f", "Invalid command"), (b"\x01\x00", "Command parser error")])
def test_what_makes_no_sense_stops_it(board, payload, reason):
    """The core with the link finds it out, the other one stops."""
    board.send_block(payload)
    assert board.find_shutdown() == reason
    assert board.query("get_config", "config")["is_shutdown"] == 1


def test_pulls_are_not_its_own(board):
    board.configure(("config_endstop", dict(oid=0, pin=board.find_pin(PINS.switch),
                                            pull_up=1)))
    assert board.find_shutdown() == "PRU does not support push/pull pins"


# A second of this chip takes some seconds here: it prints cold
HEATING = re.compile(r"^M(104|109|140|190)\b.*\n", re.M)
WIRES = {"PA0": "gpio0_2", "PA1": "gpio0_3", "PA3": "gpio0_4", "PB0": "gpio1_12",
         "PB1": "gpio1_13", "PB3": "gpio1_14", "PC0": "gpio2_1", "PC1": "gpio2_2",
         "PC3": "gpio2_3", "PE0": "gpio0_20", "PE1": "gpio0_22", "PE4": "gpio2_5",
         "PE5": "AIN0", "PF4": "gpio2_7", "PF5": "AIN1", "PF6": "gpio2_9"}


def check_lateness(run):
    """No step comes later than the firmware says, nor before its time."""
    mcu = run.printer.lookup_object("mcu")
    bound = int(mcu.get_constants()["STEP_LATENCY_TICKS"])
    for name, (_, late) in lateness.measure(run).items():
        print("%s: %d to %d ticks late" % (name, late.min(), late.max()))
        assert late.min() >= 0 and late.max() <= bound, name


@pytest.mark.slow
def test_moves_of_a_file(adapter, tmp_path, monkeypatch):
    pru_board.choose_chip(monkeypatch, firmware_matrix.build("pru"))
    config = machine_configs.make_axes("cartesian", 0.04, machine_configs.BED)
    config = re.sub(r"[~^]*\b(P[A-F]\d)\b", lambda match: WIRES[match[1]], config)
    config += "\n[simulator]\nfirmware: %s\n" % (adapter,)
    before, job = (HEATING.sub("", text) for text in
                   cut_sample("cube20.gcode", "cartesian", N_LINES))
    path = tmp_path / "job.gcode"
    path.write_text(job)
    run = PrinterRun(config, tmp_path, seed=0)
    run.machine.mcus["mcu"].link.record()
    run.run([before, path], 1)
    check_lateness(run)
    judge = Judge(run, config, job, run.snapshots[0],
                  extra_limit=machine_configs.find_limits("cartesian", config))
    assert judge.check()["stepper_x"] > 40 * N_LINES
