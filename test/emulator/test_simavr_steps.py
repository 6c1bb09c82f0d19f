# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps in a steady rhythm on an emulated AVR chip: none is lost or late, and
whatever else the chip does goes on."""

import pytest
import simavr_chip
from simavr_board import AvrBoard
from steady_steps import BOUND_US, SteadyRun

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]


@pytest.fixture
def board(atmega2560, monkeypatch):
    adapter, elf = atmega2560
    simavr_chip.choose_chip(monkeypatch, elf, "atmega2560")
    return AvrBoard(adapter)


# The first of each number of motors is what docs/performance.md promises
@pytest.mark.parametrize("n_motors, interval", [
    (1, 87), (1, 150), (1, 200), (1, 300), (1, 900),
    (3, 417), (3, 450), (3, 600), (3, 900)])
def test_steady_steps(board, n_motors, interval):
    run = SteadyRun(board, n_motors, interval, 2.0)
    assert run.find_failure(BOUND_US[n_motors]) is None


def test_slow_steps_are_not_kept_waiting(board):
    """Nothing but the way through the interrupt and a byte of the console."""
    run = SteadyRun(board, 1, 900, 2.0)
    assert run.find_failure(15) is None


class StartingRun(SteadyRun):
    """One motor steps steadily while another one is started again and again."""

    def _queue(self, n_motors):
        super()._queue(n_motors - 1)

    def _watch(self, seconds):
        board = self.board
        end = self.start + round(seconds * board.freq)
        while board.clock < end:
            clock = board.clock + round(0.03 * board.freq)
            board.send("reset_step_clock", oid=1, clock=clock % 2**32)
            board.send("queue_step", oid=1, interval=100, count=1, add=0)
            board.run_for(0.0371)

    def _judge(self, step_pins):
        super()._judge(step_pins[:1])
        self.starts = sum(pin == step_pins[1] and level
                          for _, pin, level in self.board.edges)


def test_an_idle_motor_starts_between_steps_of_others(board):
    """The way into the list of events takes longer than this bound."""
    run = StartingRun(board, 2, 907, 4.0)
    assert run.starts > 50
    assert run.find_failure(20) is None


@pytest.mark.slow
@pytest.mark.parametrize("interval", range(90, 1290, 50))
@pytest.mark.parametrize("n_motors", [1, 3])
def test_steady_steps_of_any_interval(board, n_motors, interval):
    interval += 350 * (n_motors // 3)
    run = SteadyRun(board, n_motors, interval, 2.0)
    assert run.find_failure(BOUND_US[n_motors]) is None


@pytest.mark.parametrize("n_motors, interval", [(1, 50), (3, 300)])
def test_too_many_steps_end_in_a_shutdown(board, n_motors, interval):
    run = SteadyRun(board, n_motors, interval, 2.0)
    assert run.shutdown == "Rescheduled timer in the past"
    assert run.restarts == 0
    late = max(int(late.max()) for late in run.late)
    assert late < 2e-3 * board.freq
    assert board.query("get_config", "config")["is_shutdown"] == 1
