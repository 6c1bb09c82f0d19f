# SPDX-License-Identifier: GPL-3.0-or-later
"""Emulated chips are judged with the model of the end-to-end tests."""

import pathlib
import sys

import pytest
import simavr_chip

TEST = pathlib.Path(__file__).resolve().parents[1]
sys.path += [str(TEST / "klippy"), str(TEST / "firmware")]
import simboard  # noqa: E402


@pytest.fixture(scope="module")
def atmega2560(tmp_path_factory):
    """(adapter, elf) of the largest AVR chip."""
    folder = tmp_path_factory.mktemp("simavr")
    return (simavr_chip.build_adapter(folder),
            simavr_chip.build_firmware(folder, "atmega2560"))


@pytest.fixture(autouse=True)
def close_boards():
    """Boards do not outlive the test that made them."""
    yield
    simboard.close_boards()
