# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves of a real file, over CAN and USB instead of a serial line."""

import firmware_matrix
import pytest
import unicorn_board
from test_unicorn_ports_print import PINS as PORT_PINS
from test_unicorn_print import PINS, print_and_judge

pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(bool(unicorn_board.why_not()),
                                 reason=unicorn_board.why_not())]


# Where the link has pins that the others use otherwise
OTHER_PINS = {"stm32g0b1": {"PB0": "PD0", "PB1": "PD1"}}


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.mark.parametrize("chip, n_lines", [
    ("stm32f103", 60), ("stm32g0b1", 40),
    pytest.param("stm32h743", 400, marks=pytest.mark.slow)])
def test_print_over_can(chip, n_lines, tmp_path, adapter, monkeypatch):
    """Both controllers; the emulated host gives the node its number."""
    monkeypatch.setenv("UNICORN_CAN_NODE", "4")
    unicorn_board.choose_chip(monkeypatch, firmware_matrix.build("can_" + chip), chip)
    counts = print_and_judge(tmp_path, adapter, n_lines,
                             {**PINS, **OTHER_PINS.get(chip, {})})
    assert counts["stepper_x"] > 40 * n_lines


@pytest.mark.slow
@pytest.mark.parametrize("chip", ["lpc1768", "same70q20b"])
def test_print_over_can_of_other_families(chip, tmp_path, adapter, monkeypatch):
    monkeypatch.setenv("UNICORN_CAN_NODE", "4")
    unicorn_board.choose_chip(monkeypatch, firmware_matrix.build("can_" + chip), chip,
                              12000000)
    counts = print_and_judge(tmp_path, adapter, 150, PORT_PINS[chip])
    assert counts["stepper_x"] > 40 * 150


@pytest.mark.parametrize("chip, n_lines", [
    ("stm32f407", 40), pytest.param("stm32f042", 60, marks=pytest.mark.slow)])
def test_print_over_usb(chip, n_lines, tmp_path, adapter, monkeypatch):
    unicorn_board.choose_chip(monkeypatch, firmware_matrix.build("usb_" + chip), chip)
    counts = print_and_judge(tmp_path, adapter, n_lines)
    assert counts["stepper_x"] > 40 * n_lines
