# SPDX-License-Identifier: GPL-3.0-or-later
"""What firmware must do on any chip, asked of an emulated board.

A board is one that runs and was identified (UnicornBoard, PruBoard); each check
configures it for itself.
"""

import dataclasses

import pytest
from step_runs import assert_prompt, expect_clocks, start_steps


@dataclasses.dataclass(frozen=True)
class Pins:
    """Names of the pins that the checks use."""
    step: str
    dir: str
    switch: str
    out: str
    sensor: str


def configure(board, pins, pulse=0, invert=-1, pull_up=1, more=()):
    """Stepper 0, endstop 1, trsync 2, output 3 (default 1), analog input 4."""
    pin = board.find_pin
    board.configure(
        ("config_stepper", dict(oid=0, step_pin=pin(pins.step),
                                dir_pin=pin(pins.dir), invert_step=invert,
                                step_pulse_ticks=pulse)),
        ("config_endstop", dict(oid=1, pin=pin(pins.switch), pull_up=pull_up)),
        ("config_trsync", dict(oid=2)),
        ("config_digital_out", dict(oid=3, pin=pin(pins.out), value=0,
                                    default_value=1, max_duration=0)),
        ("config_analog_in", dict(oid=4, pin=pin(pins.sensor))), *more)


def check_steps(board, pins, prompt, min_moves):
    """From the chip's clock to 50 steps, each at its clock; prompt in ticks."""
    clock = board.query("get_clock", "clock")["clock"]
    assert 0 < board.clock - clock < 0.01 * board.freq
    configure(board, pins)
    assert board.query("get_config", "config")["move_count"] > min_moves
    origin = start_steps(board, board.freq // 5000, 50, add=-3)
    board.run_for(0.1)
    edges = [c for c, _ in board.list_edges(board.find_pin(pins.step), origin)]
    assert_prompt(edges, expect_clocks(origin, board.freq // 5000, 50, -3), prompt)
    position = board.query("stepper_get_position", "stepper_position", oid=0)
    assert position["pos"] == -50
    assert board.find_shutdown() is None


def check_pulses(board, pins, prompt, pulse):
    """Pulses begin at their clocks and last `pulse` ticks or longer."""
    configure(board, pins, pulse, invert=0)
    origin = start_steps(board, board.freq // 20000, 40)
    board.run_for(0.1)
    edges = board.list_edges(board.find_pin(pins.step), origin)
    rises = [c for c, level in edges if level]
    falls = [c for c, level in edges if not level]
    assert_prompt(rises, expect_clocks(origin, board.freq // 20000, 40), prompt)
    assert all(f - r >= pulse for r, f in zip(rises, falls, strict=True))


def read_analog(board, oid=4, count=4):
    """Values of an input, each the sum of `count` readings; two or more."""
    board.send("query_analog_in", oid=oid, clock=(board.clock + board.freq // 10)
               % 2**32, sample_ticks=board.freq // 1000, sample_count=count,
               rest_ticks=board.freq // 10, bytes_per_report=2, min_value=0,
               max_value=65535, range_check_count=4)
    board.run_for(0.4)
    reports = board.list_messages("analog_in_state")
    assert len(reports) >= 2
    return [int.from_bytes(r["values"], "little") for r in reports]


def check_pwm(board, name, cycle_time):
    """A quarter, all and nothing of a cycle (s), and the default in shutdown."""
    pin, cycle = board.find_pin(name), round(cycle_time * board.freq)
    top = board.dictionary["config"]["PWM_MAX"]
    board.configure(("config_pwm_out", dict(
        oid=5, pin=pin, cycle_ticks=cycle, value=0, default_value=top,
        max_duration=0)))
    for value in (top // 4, top, 0):
        board.send("queue_pwm_out", oid=5, value=value,
                   clock=(board.clock + board.freq // 20) % 2**32)
        board.run_for(0.1 + cycle_time)
        _, at, ticks, on, whole = board.pwm[-1]
        assert at == pin and ticks == pytest.approx(cycle, rel=0.01)
        assert on / whole == pytest.approx(value / top, abs=0.001)
    board.send("emergency_stop")
    board.run_for(cycle_time)
    assert board.pwm[-1][3] == board.pwm[-1][4]


def check_spi(board, number, bus, select, before=()):
    """A device that answers with the complement, selected by a pin.

    number, bus: of the emulator's device and of the firmware; before: commands
    that give the bus its pins.
    """
    select, seen = board.find_pin(select), []

    def answer(data):
        seen.append((board.list_edges(select)[-1][1], data))
        return bytes(255 - byte for byte in data)

    board.spi_devices[number] = answer
    board.configure(
        *before, ("config_spi", dict(oid=5, pin=select, cs_active_high=0)),
        ("spi_set_bus", dict(oid=5, spi_bus=bus, mode=3, rate=4000000)))
    got = board.query("spi_transfer", "spi_transfer_response", oid=5,
                      data=b"\x01\x80\xaa")
    assert got["response"] == b"\xfe\x7f\x55"
    assert seen == [(0, b"\x01"), (0, b"\x80"), (0, b"\xaa")]
    assert board.list_edges(select)[-1][1] == 1


def check_i2c(board, number, bus, lengths=(1, 2, 3, 6), absent=((b"\x01", 0),),
              before=()):
    """A memory behind a pointer; nobody at another address.

    number, bus, before: as of check_spi(); lengths: bytes to read; absent: what
    to write and how much to read where nobody is.
    """
    seen = []

    def answer(data, n_read):
        if data:
            seen.append(data)
        return bytes(range(0x40, 0x40 + n_read))

    board.i2c_devices[number, 0x1C] = answer
    board.configure(*before, *[
        step for oid, address in ((5, 0x1C), (6, 0x1D)) for step in (
            ("config_i2c", dict(oid=oid)),
            ("i2c_set_bus", dict(oid=oid, i2c_bus=bus, rate=100000,
                                 address=address)))])
    for n_read in lengths:
        got = board.query("i2c_transfer", "i2c_response", oid=5, write=b"\x07\x81",
                          read_len=n_read)
        assert got["i2c_bus_status"] == 0
        assert got["response"] == bytes(range(0x40, 0x40 + n_read))
    board.query("i2c_transfer", "i2c_response", oid=5, write=b"\x09", read_len=0)
    assert seen == [b"\x07\x81"] * len(lengths) + [b"\x09"]
    for data, n_read in absent:
        got = board.query("i2c_transfer", "i2c_response", oid=6, write=data,
                          read_len=n_read)
        assert got["i2c_bus_status"] == 2
    assert board.find_shutdown() is None


def check_defaults(board, pins, interval=1000):
    """A shutdown amid steps (ticks apart) sets pins; the chip works on."""
    configure(board, pins)
    start_steps(board, interval, 60000)
    board.run_for(0.06)
    board.send("emergency_stop")
    stopped = board.list_messages("shutdown")[0]["#clock"]
    assert board.find_shutdown() == "Command request"
    assert board.list_edges(board.find_pin(pins.out))[-1][1] == 1
    assert not board.list_edges(board.find_pin(pins.step), stopped)
    # it left the interrupt, if it was in one: everything goes on
    assert board.query("get_uptime", "uptime")["clock"] > 0
    board.send("clear_shutdown")
    assert board.query("get_config", "config")["is_shutdown"] == 0


def check_shutdown_in_interrupt(board, pins, interval):
    """More steps than the chip can make: a clear end, and the clock goes on."""
    configure(board, pins)
    start_steps(board, interval, 60000)
    board.run_for(0.1)
    assert board.find_shutdown() == "Rescheduled timer in the past"
    clock = board.query("get_clock", "clock")["clock"]
    board.run_for(0.5)
    assert board.query("get_clock", "clock")["clock"] > clock
    assert not board.resets


def time_to_reset(board, limit=2.):
    """Seconds until a chip that hangs is reset by its watchdog, at most limit."""
    begin = board.clock
    while not board.resets and board.clock < begin + limit * board.freq:
        board.run_for(0.05)
    assert board.resets
    return (board.resets[0] - begin) / board.freq
