# SPDX-License-Identifier: GPL-3.0-or-later
"""Emulated chips are USB devices of a real kernel: its drivers meet our firmware."""

import firmware_matrix
import machine
import pytest
import unicorn_board
from can_bus import BridgeBoard, BridgedBus
from usb_redirect import Redirect

pytestmark = [pytest.mark.slow, pytest.mark.emulator,
              pytest.mark.skipif(bool(machine.why_not() or unicorn_board.why_not()),
                                 reason=machine.why_not() or unicorn_board.why_not())]
MODULES = ("uhci_hcd", "gs_usb", "can_raw", "cdc_acm")


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return unicorn_board.build_adapter(tmp_path_factory.mktemp("unicorn"))


@pytest.fixture
def run(adapter, monkeypatch, tmp_path):
    """run(config, chip, what, kind): lines that the guest is content with."""
    def make(config, chip, what, kind, prepare=lambda board: None):
        out = firmware_matrix.build(config)
        unicorn_board.choose_chip(monkeypatch, out, chip)
        board = kind(adapter)
        board.run_for(.1)
        server = Redirect(board, tmp_path / "usb", prepare(board))
        server.start()
        try:
            output = machine.run(tmp_path, MODULES, "chip_host.py", what,
                                 usb=tmp_path / "usb")
        finally:
            server.close()
        return [line[3:] for line in output.splitlines() if line.startswith("ok ")]
    return make


def test_can_adapter_meets_gs_usb(run):
    def prepare(board):
        bus = BridgedBus([board])
        return lambda: bus.run_for(.002)
    done = run("bridge_stm32f446", "stm32f446", "can", BridgeBoard, prepare)
    assert done[0].startswith("listed ")
    assert done[1:] == ["identified as stm32f446xx", "answers"]


def test_serial_port_meets_cdc_acm(run):
    done = run("usb_stm32f042", "stm32f042", "serial", unicorn_board.UnicornBoard)
    assert done == ["identified as stm32f042x6", "answers", "left"]
