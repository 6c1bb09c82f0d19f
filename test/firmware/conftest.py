# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures: the simulator firmware, built once a session, and boards of it."""

import pytest
import simboard
from linux_board import build_linux
from simboard import SimBoard, build_simulator


@pytest.fixture(scope="session")
def simulator_so():
    return build_simulator()


@pytest.fixture(scope="session")
def linux_elf():
    """The linux firmware's program."""
    return build_linux()


@pytest.fixture(autouse=True)
def close_boards():
    """Boards do not outlive the test that made them."""
    yield
    simboard.close_boards()


@pytest.fixture
def make_board(simulator_so):
    """Make boards; none may end its test with a timer that ran late."""
    boards = []

    def make(clock=0):
        board = SimBoard(simulator_so, clock)
        board.identify()
        boards.append(board)
        return board
    yield make
    for board in boards:
        assert board.late == []


@pytest.fixture
def board(make_board):
    return make_board()
