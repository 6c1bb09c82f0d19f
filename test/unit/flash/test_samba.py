# SPDX-License-Identifier: GPL-3.0-or-later
"""The real bossac writes to a SAM chip in its boot loader, on a terminal."""

import shutil
import termios
import threading

import pytest
from samba_board import Sam4eBoard, SamdBoard
from test_methods import IMAGE, make_target

from klippy.errors import PrinterError
from klippy.flash import methods, touch

SAMBA = "03eb:6124"
needs_bossac = pytest.mark.skipif(not shutil.which("bossac"), reason="needs bossac")


@pytest.fixture
def root(tmp_path):
    root = tmp_path / "root"
    (root / "dev/serial/by-id").mkdir(parents=True)
    (root / "sys/bus/usb/devices").mkdir(parents=True)
    return root


@pytest.fixture
def start(monkeypatch):
    """start(kind): a board that listens; bossac takes its terminal for USB."""
    monkeypatch.setenv("FLASH_ARGS", "-U")
    boards = []

    def make(kind):
        board = kind()
        boards.append(board)
        board.start()
        return board
    yield make
    for board in boards:
        board.close()


def plug(root, usb_id, board, port="ttyACM0"):
    """The board appears on USB, with its serial port."""
    devices = root / "sys/bus/usb/devices"
    (devices / "1-1").mkdir()
    (devices / "1-1:1.0/tty" / port).mkdir(parents=True)
    (root / "dev" / port).symlink_to(board.path)
    vendor, product = usb_id.split(":")
    (devices / "1-1/idVendor").write_text(vendor + "\n")
    (devices / "1-1/idProduct").write_text(product + "\n")


def make_sam4(folder):
    return make_target(folder, BOARD_DIRECTORY="atsam", MCU="sam4e8e")


def assert_written(board):
    assert bytes(board.memory[:len(IMAGE)]) == IMAGE
    assert set(board.memory[len(IMAGE) + 512:]) == {0xFF}
    assert board.gpnvm == 2                  # from flash, next time
    assert board.n_programs > 10
    assert board.was_reset.wait(5)          # bossac does not


@needs_bossac
@pytest.mark.parametrize("device", ["", SAMBA, "ttyACM0"])
def test_chip_that_waits_in_rom(device, root, start, tmp_path):
    """Found by itself, by its id, or as the port that somebody names."""
    board = start(Sam4eBoard)
    plug(root, SAMBA, board)
    if device.startswith("tty"):
        device = str(root / "dev" / device)
    methods.flash(make_sam4(tmp_path), device, root=str(root))
    assert_written(board)


@needs_bossac
def test_running_firmware_is_asked_first(root, start, tmp_path):
    """Its port is opened at 1200 baud; the chip comes back in its ROM."""
    firmware, board = start(Sam4eBoard), start(Sam4eBoard)
    path = root / "dev/serial/by-id/usb-Klipper_sam4e8e_12-if00"
    path.symlink_to(firmware.path)
    came = threading.Event()

    def follow():
        while termios.tcgetattr(firmware.slave)[5] != termios.B1200:
            if came.wait(.005):
                return
        path.unlink()
        plug(root, SAMBA, board, "ttyACM1")
    thread = threading.Thread(target=follow)
    thread.start()
    try:
        methods.flash(make_sam4(tmp_path), "", root=str(root))
    finally:
        came.set()
        thread.join()
    assert_written(board)
    assert set(firmware.memory) == {0x5A}


@needs_bossac
def test_samd_keeps_its_boot_loader(start, tmp_path, monkeypatch):
    """The board was reset twice: its loader has a name that tells nothing, and a
    touch brings up nothing else."""
    def wait_in_vain(*args):
        raise PrinterError("did not start its boot loader")
    board = start(SamdBoard)
    monkeypatch.setattr(touch, "wait_for_change", wait_in_vain)
    target = make_target(tmp_path, BOARD_DIRECTORY="atsamd", MCU="samd21g18a",
                         FLASH_APPLICATION_ADDRESS="0x2000")
    methods.flash(target, board.path)
    assert set(board.memory[:0x2000]) == {0x5A}
    assert bytes(board.memory[0x2000:0x2000 + len(IMAGE)]) == IMAGE
    assert set(board.memory[0x2000 + len(IMAGE) + 64:]) == {0xFF}
    assert board.was_reset.wait(5)


def test_a_boot_loader_without_port(root, monkeypatch):
    devices = root / "sys/bus/usb/devices/1-1"
    devices.mkdir()
    (devices / "idVendor").write_text("03eb\n")
    (devices / "idProduct").write_text("6124\n")
    naps = []
    monkeypatch.setattr(touch, "sleep", naps.append)
    with pytest.raises(PrinterError, match="has no serial port"):
        touch.wait_for_port(SAMBA, str(root))
    assert 9 < sum(naps) < 11
