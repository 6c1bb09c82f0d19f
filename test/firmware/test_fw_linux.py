# SPDX-License-Identifier: GPL-3.0-or-later
"""The linux firmware in real time on its terminal, with fake pins.

Nothing here depends on how fast or how punctual the machine is: delays show as
jitter in the output (pytest -s), not as failures.
"""

import os
import signal
import struct

import linux_bench
import pytest
from linux_board import FREQ, LinuxBoard

STEP, DIR, SWITCH, LED, FAN = "gpio1", "gpio2", "gpio3", "gpio4", "gpio5"
INTERVAL = 5000          # ticks: 10,000 steps/s
LEAD = FREQ // 2         # ticks between planning and doing
RULES = """
stepper x %s %s
switch %s 1 below -50 x 1   # pressed from the 51st step back
""" % (STEP, DIR, SWITCH)


@pytest.fixture
def make_board(linux_elf, tmp_path):
    boards = []

    def make(*options):
        board = LinuxBoard(linux_elf, tmp_path, "--max-late", "10000", *options,
                           rules=RULES)
        boards.append(board)
        return board
    yield make
    for board in boards:
        assert board.close() == 0
        assert not os.path.lexists(board.run.link)


@pytest.fixture
def board(make_board):
    return make_board()


def config_stepper(host, oid=0):
    return ("config_stepper", dict(
        oid=oid, step_pin=host.find_pin(STEP), dir_pin=host.find_pin(DIR),
        invert_step=0, step_pulse_ticks=100))


def start_stepper(host, direction):
    clock = (host.get_clock() + LEAD) & 0xFFFFFFFF
    host.send("reset_step_clock", oid=0, clock=clock)
    host.send("set_next_step_dir", oid=0, dir=direction)
    return clock


def get_position(host):
    return host.query("stepper_get_position", "stepper_position", oid=0)["pos"]


def test_dictionary(board):
    config = board.host.dictionary["config"]
    assert config["MCU"] == "linux"
    assert config["CLOCK_FREQ"] == FREQ
    assert config["ADC_MAX"] == 4095
    assert config["PWM_MAX"] == 32768
    enums = board.host.dictionary["enumerations"]
    assert "pwmchip7/pwm0" in enums["pin"] and "analog0" in enums["pin"]
    assert "spidev3.0" in enums["spi_bus"] and "i2c.0" in enums["i2c_bus"]
    answer = board.host.query("get_config", "config")
    assert (answer["is_config"], answer["is_shutdown"]) == (0, 0)


def test_clock_is_that_of_the_system(board):
    before = board.io.read_clock()
    clock = board.host.get_clock()
    assert before <= clock <= board.io.read_clock()


def test_digital_outputs_and_pins_beyond_255(board):
    far = "gpiochip2/gpio300"
    host = board.host
    host.configure(*[("config_digital_out", dict(
        oid=oid, pin=host.find_pin(name), value=oid, default_value=0,
        max_duration=0)) for oid, name in enumerate((LED, far))])
    assert (board.io.level(LED), board.io.level(far)) == (0, 1)
    host.send("update_digital_out", oid=0, value=1)
    host.send("update_digital_out", oid=1, value=0)
    assert (board.io.level(LED), board.io.level(far)) == (1, 0)


def test_scheduled_output_is_not_early(board):
    host = board.host
    host.configure(("config_digital_out", dict(
        oid=0, pin=host.find_pin(LED), value=0, default_value=0,
        max_duration=0)))
    clock = board.io.read_clock() + LEAD
    host.send("queue_digital_out", oid=0, clock=clock & 0xFFFFFFFF, on_ticks=1)
    host.wait(lambda: board.io.level(LED))
    (edge, level), = board.io.list_edges(LED)
    assert edge >= clock and level == 1


def test_software_pwm(board):
    """The planned edges all come, in order; the duty follows from them."""
    host = board.host
    cycle, on_ticks, n_cycles = 500000, 125000, 20
    host.configure(("config_digital_out", dict(
        oid=0, pin=host.find_pin(FAN), value=0, default_value=0,
        max_duration=0)))
    host.send("set_digital_out_pwm_cycle", oid=0, cycle_ticks=cycle)
    clock = board.io.read_clock() + LEAD
    for at, value in ((clock, on_ticks), (clock + n_cycles * cycle, 0)):
        host.send("queue_digital_out", oid=0, clock=at & 0xFFFFFFFF,
                  on_ticks=value)
    host.wait(lambda: board.io.edge_count(FAN) >= 2 * n_cycles)
    edges = board.io.list_edges(FAN)
    assert [level for _, level in edges] == [1, 0] * n_cycles
    planned = [clock + i * cycle + part for i in range(n_cycles)
               for part in (0, on_ticks)]
    assert all(edge >= plan for (edge, _), plan in zip(edges, planned, strict=True))
    assert board.io.on_seconds(FAN) > 0


def test_hardware_pwm(board):
    host, pin = board.host, "pwmchip1/pwm2"
    host.configure(("config_pwm_out", dict(
        oid=0, pin=host.find_pin(pin), cycle_ticks=FREQ // 1000, value=8192,
        default_value=0, max_duration=0)))
    assert board.io.pwm(pin) == (.001, .25)
    host.send("queue_pwm_out", oid=0, clock=host.get_clock() + LEAD, value=32768)
    host.wait(lambda: board.io.pwm(pin)[1] == 1.)
    host.send("emergency_stop")
    host.wait_shutdown()
    assert board.io.pwm(pin)[1] == 0.


def query_analog(board, **values):
    board.host.configure(("config_analog_in", dict(
        oid=0, pin=board.host.find_pin("analog3"))))
    args = dict(oid=0, clock=board.host.get_clock() + LEAD, sample_ticks=50000,
                sample_count=4, rest_ticks=FREQ // 50, bytes_per_report=2,
                min_value=0, max_value=0xFFFF, range_check_count=1)
    board.host.send("query_analog_in", **dict(args, **values))


def test_analog_input(board):
    board.io.set_adc("analog3", .5)
    query_analog(board)
    values = board.host.wait_message("analog_in_state")["values"]
    assert struct.unpack("<H", values) == (2048 * 4,)
    board.io.set_adc("analog3", 1.)
    board.host.wait(lambda: struct.unpack("<H", board.host.list_messages(
        "analog_in_state")[-1]["values"]) == (4095 * 4,))


def test_analog_out_of_range(board):
    query_analog(board, max_value=1000)
    assert board.host.wait_shutdown() == "ADC out of range"


def test_ten_thousand_steps(board):
    """Every step comes, none early; says how late they came."""
    host, n_steps = board.host, 10000
    host.configure(config_stepper(host))
    start = start_stepper(host, 1)
    edge_count = board.io.count_edges()
    clock64 = board.io.read_clock()
    start64 = clock64 + ((start - clock64) & 0xFFFFFFFF)
    for _ in range(10):
        host.send("queue_step", oid=0, interval=INTERVAL, count=n_steps // 10,
                  add=0)
    host.wait(lambda: board.io.stepper(0)[1] >= n_steps)
    assert get_position(host) == n_steps
    assert board.io.stepper(0) == (n_steps, n_steps)
    rises = [c for c, level in board.io.list_edges(STEP, edge_count) if level]
    late = sorted(c - start64 - (i + 1) * INTERVAL for i, c in enumerate(rises))
    assert len(rises) == n_steps and late[0] >= 0
    print("\nsteps late, us: median %.1f, 99%% %.1f, worst %.1f"
          % tuple(late[i] / (FREQ / 1e6) for i in (n_steps // 2,
                                                   n_steps * 99 // 100, -1)))


def test_homing_stops_at_the_switch(board):
    host, oids = board.host, dict(stepper=0, endstop=1, trsync=2)
    host.configure(config_stepper(host), ("config_endstop", dict(
        oid=oids["endstop"], pin=host.find_pin(SWITCH), pull_up=1)),
        ("config_trsync", dict(oid=oids["trsync"])))
    start = start_stepper(host, 0)
    host.send("trsync_start", oid=2, report_clock=start, report_ticks=FREQ,
              expire_reason=4)
    host.send("stepper_stop_on_trigger", oid=0, trsync_oid=2)
    host.send("trsync_set_timeout", oid=2, clock=(start + 20 * FREQ) & 0xFFFFFFFF)
    host.send("endstop_home", oid=1, clock=start, sample_ticks=500,
              sample_count=4, rest_ticks=2500, pin_value=1, trsync_oid=2,
              trigger_reason=1)
    host.send("queue_step", oid=0, interval=INTERVAL, count=60000, add=0)
    host.wait(lambda: any(not m["can_trigger"]
                          for m in host.list_messages("trsync_state")))
    final = host.list_messages("trsync_state")[-1]
    assert final["trigger_reason"] == 1
    position, total = board.io.stepper(0)
    assert position == get_position(host) == -total
    # A held-up process samples late, but long before the run ends.
    assert -60000 < position <= -51
    assert host.query("endstop_query_state", "endstop_state",
                      oid=1)["pin_value"] == 1


def test_switch_without_a_rule(board):
    host, name = board.host, "gpio77"
    host.configure(("config_endstop", dict(oid=0, pin=host.find_pin(name),
                                           pull_up=1)))

    def read():
        return host.query("endstop_query_state", "endstop_state",
                          oid=0)["pin_value"]
    assert read() == 1
    board.io.set_input(name, 0)
    assert read() == 0


def test_emergency_stop_then_reset(board):
    host = board.host
    host.configure(("config_digital_out", dict(
        oid=0, pin=host.find_pin(LED), value=1, default_value=0,
        max_duration=0)))
    host.send("emergency_stop")
    assert host.wait_shutdown() == "Command request"
    assert board.io.level(LED) == 0
    assert host.query("get_config", "config")["is_shutdown"] == 1
    check_reset(board)
    host.configure(config_stepper(host))
    assert host.query("get_config", "config")["is_config"] == 1


def check_reset(board):
    """A new image answers on the same terminal, in the same process."""
    host, n = board.host, len(board.host.messages)
    boots, terminal = board.io.boots, os.readlink(board.run.link)
    host.send_only("reset")
    host.wait_message("starting", n)
    host.seq = 0
    host.identify()
    answer = host.query("get_config", "config")
    assert (answer["is_config"], answer["is_shutdown"]) == (0, 0)
    assert board.io.boots == boots + 1
    assert os.readlink(board.run.link) == terminal
    assert board.run.process.poll() is None


def test_reset_lets_go_of_outputs_first(board):
    host = board.host
    host.configure(("config_digital_out", dict(
        oid=0, pin=host.find_pin(LED), value=1, default_value=0,
        max_duration=0)))
    check_reset(board)
    assert [level for _, level in board.io.list_edges(LED)] == [1, 0]
    assert not board.io.is_used(LED)
    check_reset(board)


def test_config_reset_needs_a_shutdown(board):
    board.host.send_only("config_reset")
    assert board.host.wait_shutdown() == "config_reset only available when shutdown"


def test_end_puts_outputs_back(board):
    host = board.host
    host.configure(("config_digital_out", dict(
        oid=0, pin=host.find_pin(LED), value=0, default_value=1,
        max_duration=0)))
    assert board.run.stop() == 0
    assert board.io.level(LED) == 1


def test_suspended_process_shuts_down(make_board):
    """Who sleeps through its timers must not race after them."""
    board = make_board("--max-late", "50")
    host = board.host
    host.configure(("config_digital_out", dict(
        oid=0, pin=host.find_pin(LED), value=0, default_value=0,
        max_duration=0)))
    due = board.io.read_clock() + LEAD
    host.send("queue_digital_out", oid=0, clock=due & 0xFFFFFFFF, on_ticks=1)
    board.run.process.send_signal(signal.SIGSTOP)
    late = due + FREQ // 10
    host.wait(lambda: board.io.read_clock() > late)
    board.run.process.send_signal(signal.SIGCONT)
    assert host.wait_shutdown() == "Rescheduled timer in the past"
    assert board.io.level(LED) == 0
    host.send("clear_shutdown")
    assert host.query("get_config", "config")["is_shutdown"] == 0


def test_two_hosts_one_after_the_other(board):
    board.host.close()
    board.host = type(board.host)(board.run.link)
    # The mcu goes on counting blocks: the first answer says where it is.
    os.write(board.host.fd, b"\x7e\x05\x10\x00\x00\x7e")
    board.host.wait(lambda: board.host.acked is not None)
    board.host.seq = board.host.acked
    assert board.host.identify()["config"]["MCU"] == "linux"


@pytest.mark.parametrize("pin, command, reason", [
    ("pwmchip0/pwm0", "config_digital_out", "Not an output pin"),
    ("gpio1", "config_pwm_out", "Not a valid PWM pin"),
    ("gpio1", "config_analog_in", "Not a valid ADC pin"),
    ("analog0", "config_endstop", "Not a valid input pin"),
])
def test_pins_of_another_kind(board, pin, command, reason):
    host = board.host
    values = {"config_digital_out": dict(value=0, default_value=0, max_duration=0),
              "config_pwm_out": dict(cycle_ticks=1000, value=0, default_value=0,
                                     max_duration=0),
              "config_analog_in": {}, "config_endstop": dict(pull_up=0)}[command]
    host.send("allocate_oids", count=1)
    host.send(command, oid=0, pin=host.find_pin(pin), **values)
    assert host.wait_shutdown() == reason


def test_commands_a_second():
    """Processor time of one, far above what it takes on a slow computer."""
    seconds = linux_bench.measure_nop()
    print("%.1f million commands a second" % (1e-6 / seconds,))
    assert 0 < seconds < 5e-6
