# SPDX-License-Identifier: GPL-3.0-or-later
"""Every AVR chip, emulated: boots, identifies, steps, measures, shuts down."""

import firmware_matrix
import pytest
import simavr_chip
from simavr_board import AvrBoard, find_pin

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]

# Per chip a pin with hardware pwm, where its duty and its control are, and the
# bit there that connects the pin
PWM = {"atmega168": ("PB3", 0xB3, 0xB0), "atmega644p": ("PB3", 0x47, 0x44),
       "atmega1284p": ("PB6", 0x98, 0x90), "atmega1280": ("PE3", 0x98, 0x90),
       "atmega32u4": ("PC6", 0x98, 0x90), "at90usb646": ("PC6", 0x98, 0x90)}
for like, names in {"atmega168": ["atmega328", "atmega328p"],
                    "atmega1280": ["atmega2560"],
                    "at90usb646": ["at90usb1286"]}.items():
    PWM.update(dict.fromkeys(names, PWM[like]))
CONNECT = 0x80
STACK_SPARE = 24
TIMSK1 = 0x6F
STEP, DIR, OUT = "PB0", "PB1", "PB2"
CONFIGS = sorted(set(simavr_chip.CHIPS))


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return simavr_chip.build_adapter(tmp_path_factory.mktemp("simavr"))


@pytest.fixture(scope="module", params=CONFIGS)
def chip(request, tmp_path_factory):
    """(name of the configuration, its firmware)"""
    out = tmp_path_factory.mktemp("avr")
    return request.param, simavr_chip.build_firmware(out, request.param)


@pytest.fixture
def board(chip, adapter, monkeypatch):
    name, elf = chip
    simavr_chip.choose_chip(monkeypatch, elf, name)
    board = AvrBoard(adapter)
    yield board
    kept = int(firmware_matrix.read_options(elf.parent)["STACK_SIZE"])
    used = board.read_stack(kept)
    print("%s: %d of %d bytes of stack" % (name, used, kept))
    assert used <= kept - STACK_SPARE


def configure(board, *more):
    """A stepper (0), an output that goes high at shutdown (1), and more."""
    step, direction, out = (find_pin(board, name) for name in (STEP, DIR, OUT))
    board.configure(
        ("config_stepper", dict(oid=0, step_pin=step, dir_pin=direction,
                                invert_step=0, step_pulse_ticks=32)),
        ("config_digital_out", dict(oid=1, pin=out, value=0, default_value=1,
                                    max_duration=0)), *more, oids=3)


def test_identifies_with_room_for_moves(board, chip):
    constants = board.dictionary["config"]
    assert constants["MCU"] == chip[0].split("_")[0]
    assert constants["CLOCK_FREQ"] == 16000000
    configure(board)
    answer = board.query("get_config", "config")
    assert answer["is_config"] == 1 and answer["crc"] == 1234
    assert answer["move_count"] >= 12


def test_steps(board):
    configure(board)
    start = board.query("get_clock", "clock")["clock"] + 1600000
    board.send("reset_step_clock", oid=0, clock=start)
    board.send("set_next_step_dir", oid=0, dir=1)
    board.send("queue_step", oid=0, interval=2000, count=300, add=-3)
    board.send("queue_step", oid=0, interval=80000, count=4, add=100)
    board.run_for(0.2)
    assert board.find_shutdown() is None
    rises = [clock for clock, level in board.list_edges(find_pin(board, STEP))
             if level]
    due, clock = [], start
    for interval, count, add in ((2000, 300, -3), (80000, 4, 100)):
        for _ in range(count):
            clock += interval
            interval += add
            due.append(clock)
    late = [done - clock for done, clock in zip(rises, due, strict=True)]
    assert min(late) >= -16 and max(late) < 12 * 16
    position = board.query("stepper_get_position", "stepper_position", oid=0)
    assert position["pos"] == 304


def test_measures(board, chip):
    if "config_analog_in" not in board.commands:
        pytest.skip("built without analog inputs")
    pin = simavr_chip.CHIPS[chip[0]][5]
    number = find_pin(board, pin)
    board.analog[number] = 30000
    configure(board, ("config_analog_in", dict(oid=2, pin=number)))
    clock = board.query("get_clock", "clock")["clock"] + 160000
    board.send("query_analog_in", oid=2, clock=clock, sample_ticks=16000,
               sample_count=4, rest_ticks=400000, bytes_per_report=2,
               min_value=0, max_value=4095, range_check_count=0)
    board.run_for(0.06)
    answers = board.list_messages("analog_in_state")
    assert answers
    value = int.from_bytes(answers[-1]["values"][:2], "little")
    assert value == pytest.approx(4 * 1023 * 30000 / 65536, abs=12)


def test_pwm(board, chip):
    if "config_pwm_out" not in board.commands:
        pytest.skip("built without hardware pwm")
    pin, duty, control = PWM[chip[0]]
    configure(board, ("config_pwm_out", dict(
        oid=2, pin=find_pin(board, pin), cycle_ticks=16000, value=60,
        default_value=0, max_duration=0)))

    def peek(addr):
        return board.query("debug_read", "debug_result", order=0, addr=addr)["val"]

    assert peek(duty) == 60 and peek(control) & CONNECT
    clock = board.query("get_clock", "clock")["clock"] + 320000
    board.send("queue_pwm_out", oid=2, clock=clock, value=200)
    board.run_for(0.03)
    assert peek(duty) == 200


def test_shutdown_sets_pins(board):
    configure(board)
    out = find_pin(board, OUT)
    clock = board.query("get_clock", "clock")["clock"]
    board.send("reset_step_clock", oid=0, clock=clock + 640000)
    board.send("queue_step", oid=0, interval=1000, count=60000, add=0)
    board.run_for(0.05)
    assert not [level for _, level in board.list_edges(out) if level]
    stop = board.clock
    board.send("emergency_stop")
    rises = [clock for clock, level in board.list_edges(out) if level]
    assert len(rises) == 1 and rises[0] - stop < 0.003 * board.freq
    board.run_for(0.01)
    last = [clock for clock, _ in board.list_edges(find_pin(board, STEP))][-1]
    assert last - rises[0] < 0.001 * board.freq
    assert board.query("get_config", "config")["is_shutdown"] == 1


def test_watchdog_ends_a_hang(board):
    """Timers that no longer run: the chip starts again."""
    configure(board)
    assert board.query("get_config", "config")["is_config"] == 1
    board.send("debug_write", order=0, addr=TIMSK1, val=0)
    board.run_for(0.2)
    assert board.query("get_config", "config")["is_config"] == 1
    board.run_for(0.6)
    board.seq, board.partial = 0, b""
    assert board.query("get_config", "config")["is_config"] == 0
