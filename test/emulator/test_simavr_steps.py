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
