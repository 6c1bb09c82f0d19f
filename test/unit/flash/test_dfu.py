# SPDX-License-Identifier: GPL-3.0-or-later
"""The real dfu-util writes to boot loaders on a USB that is a socket."""

import os
import pathlib
import shutil
import subprocess
import sys
import termios
import threading

import firmware_matrix
import pytest
from dfu_board import DfuBoard, DfuSeBoard, SmoothieBoard, build_library
from pty_board import PtyBoard
from test_methods import IMAGE, make_target

from klippy.errors import PrinterError
from klippy.flash import dfu, methods

HEADER = pathlib.Path("/usr/include/libusb-1.0/libusb.h")
DFUSE = "0483:df11"

pytestmark = pytest.mark.skipif(
    not shutil.which("dfu-util") or not HEADER.exists(),
    reason="needs dfu-util and libusb-1.0-0-dev")


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("libusb")
    build_library(folder)
    return folder


@pytest.fixture
def plug(library, tmp_path, monkeypatch):
    """plug(kind): a device of that kind on the only USB that dfu-util sees."""
    path = tmp_path / "usb"
    monkeypatch.setenv("LD_LIBRARY_PATH", str(library))
    monkeypatch.setenv("MODEL_USB", str(path))
    boards = []

    def make(kind):
        board = kind(path)
        boards.append(board)
        return board

    def start(kind=DfuSeBoard):
        board = make(kind)
        board.start()
        return board
    start.later = make
    yield start
    for board in boards:
        board.close()


def make_stm32(folder, start=0x8008000, **options):
    return make_target(folder, BOARD_DIRECTORY="stm32", MCU="stm32f446xx",
                       FLASH_APPLICATION_ADDRESS=hex(start), **options)


def assert_written(board, start=0x8008000, image=IMAGE):
    """All of the image, what is beside it kept, started where it begins."""
    offset = start - board.FLASH
    assert bytes(board.memory[offset:offset + len(image)]) == image
    assert set(board.memory[:offset]) <= {0x5A}
    last_sector = board.find_sector(start + len(image) - 1)
    assert set(board.memory[sum(last_sector):]) == {0x5A}
    assert board.started_at == start


@pytest.mark.parametrize("tells", [True, False])
def test_dfuse_writes_and_reads_back(tells, plug, tmp_path, capfd):
    """Also on a chip that is gone at once, of which dfu-util makes an error."""
    board = plug()
    board.tells_that_it_leaves = tells
    methods.flash(make_stm32(tmp_path), DFUSE)
    assert_written(board)
    out, err = capfd.readouterr()
    assert "read back: 3000 bytes are the same" in out
    assert ("Error during download get_status" in err) is not tells


def test_dfuse_erases_all_sectors_of_a_larger_image(plug, tmp_path):
    board = plug()
    target = make_stm32(tmp_path, 0x8000000)
    image = IMAGE * 30                      # 4 sectors of 16, one of 64 KiB
    (tmp_path / "klipper.bin").write_bytes(image)
    methods.flash(target, DFUSE.upper())
    assert_written(board, 0x8000000, image)
    assert len(set(board.erased)) == 5


def test_worn_flash_is_seen(plug, tmp_path):
    board = plug()
    board.bad_cells = {0x8000 + 100, 0x8000 + 2999}
    with pytest.raises(PrinterError, match="differs in 2 of 3000 bytes, the first "
                       "at 0x8008064"):
        methods.flash(make_stm32(tmp_path), DFUSE)


def test_protected_chip_is_refused(plug, tmp_path):
    board = plug()
    board.is_protected = True
    with pytest.raises(PrinterError, match="'dfu-util' failed"):
        methods.flash(make_stm32(tmp_path), DFUSE)
    assert set(board.memory) == {0x5A} and board.started_at is None


def test_flash_that_the_chip_does_not_have(plug, tmp_path):
    board = plug()
    with pytest.raises(PrinterError, match="'dfu-util' failed"):
        methods.flash(make_stm32(tmp_path, 0x8100000), DFUSE)
    assert set(board.memory) == {0x5A}


def test_nothing_is_plugged_in(plug, tmp_path):
    with pytest.raises(PrinterError, match="'dfu-util' failed"):
        methods.flash(make_stm32(tmp_path), DFUSE)


def test_what_cannot_be_read_back_is_told():
    with pytest.raises(PrinterError, match="could not be read back .*status 74"):
        dfu._compare(b"1234", b"12", 0, 74)


def test_stm32duino_takes_its_setting_for_flash(plug, tmp_path):
    board = plug(DfuBoard)
    methods.flash(make_stm32(tmp_path, 0x8002000), "1eaf:0003")
    assert bytes(board.memory[0x2000:0x2000 + len(IMAGE)]) == IMAGE
    assert set(board.memory[:0x2000]) == {0x5A}
    assert board.is_reset                   # which starts the firmware


def test_smoothieware_boot_loader(plug, tmp_path):
    board = plug(SmoothieBoard)
    target = make_target(tmp_path, BOARD_DIRECTORY="lpc176x", MCU="lpc1769",
                         FLASH_APPLICATION_ADDRESS="0x4000")
    methods.flash(target, "1d50:6015")
    assert bytes(board.memory[0x4000:0x4000 + len(IMAGE)]) == IMAGE
    assert set(board.memory[:0x4000]) == {0x5A}


def test_running_firmware_is_asked_first(plug, tmp_path):
    """Its port is opened at 1200 baud, then the boot loader comes on USB."""
    root = tmp_path / "root"
    (root / "dev/serial/by-id").mkdir(parents=True)
    (root / "sys/bus/usb/devices").mkdir(parents=True)
    firmware, board = PtyBoard(), plug.later(DfuSeBoard)
    port = root / "dev/serial/by-id/usb-Klipper_stm32f446xx_12-if00"
    port.symlink_to(firmware.path)
    over = threading.Event()

    def follow():
        while termios.tcgetattr(firmware.slave)[5] != termios.B1200:
            if over.wait(.005):
                return
        port.unlink()
        folder = root / "sys/bus/usb/devices/1-1"
        folder.mkdir()
        (folder / "idVendor").write_text("0483\n")
        (folder / "idProduct").write_text("df11\n")
        board.start()
    firmware.serve = lambda: firmware.take(1)
    firmware.start()
    thread = threading.Thread(target=follow)
    thread.start()
    try:
        methods.flash(make_stm32(tmp_path, USBSERIAL="y"), "", root=str(root))
    finally:
        over.set()
        thread.join()
        firmware.close()
    assert_written(board)


@pytest.mark.skipif(not firmware_matrix.find_prefix("usb_stm32f407"),
                    reason="needs gcc-arm-none-eabi")
def test_make_flash_builds_and_writes(plug):
    board = plug()
    out = firmware_matrix.build("usb_stm32f407")
    # a make that runs this test tells its children to say where they are
    env = {key: value for key, value in os.environ.items() if key[:4] != "MAKE"}
    result = subprocess.run(
        ["make", "flash", "FLASH_DEVICE=" + DFUSE,
         "OUT=%s/" % (os.path.relpath(out, firmware_matrix.ROOT),),
         "KCONFIG_CONFIG=%s" % (out / "chosen.config",),
         "PYTHON=" + sys.executable],
        cwd=firmware_matrix.ROOT, env=env, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.rstrip().endswith("Done")
    start = int(firmware_matrix.read_options(out)["FLASH_APPLICATION_ADDRESS"], 0)
    assert_written(board, start, (out / "klipper.bin").read_bytes())
