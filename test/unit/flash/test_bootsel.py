# SPDX-License-Identifier: GPL-3.0-or-later
"""A UF2 file gets into an RP2040 or RP2350, whatever it runs."""

import os

import pytest
from pico_board import PicoBoard
from test_methods import IMAGE, make_target

from klippy.errors import PrinterError
from klippy.flash import methods, touch, uf2

START = 0x10000000


@pytest.fixture
def make_board(tmp_path, monkeypatch):
    boards = []

    def make(mcu="rp2040"):
        folder = tmp_path / ("board%d" % (len(boards),))
        folder.mkdir()
        board = PicoBoard(folder, mcu)
        boards.append(board)
        monkeypatch.setattr(touch, "sleep", board.wait)
        return board
    yield make
    for board in boards:
        board.close()


def make_pico(folder, mcu="rp2040", **options):
    target = make_target(folder, BOARD_DIRECTORY="rp2040", MCU=mcu,
                         **{"USBSERIAL": "y", **options})
    (folder / "klipper.uf2").write_bytes(uf2.convert(IMAGE, START, uf2.FAMILIES[mcu]))
    return target


def flash(board, target, device=""):
    methods.flash(target, device, root=str(board.root))


def assert_runs(board):
    written = bytes(board.flash[START + i] for i in range(len(IMAGE)))
    assert written == IMAGE
    assert board.link.is_symlink() and not board.usb.exists()


def add_program(monkeypatch, folder, name, script):
    bin_folder = folder / "bin"
    bin_folder.mkdir(exist_ok=True)
    path = bin_folder / name
    path.write_text("#!/bin/sh\n" + script)
    path.chmod(0o755)
    if str(bin_folder) not in os.environ["PATH"]:
        monkeypatch.setenv("PATH", "%s:%s" % (bin_folder, os.environ["PATH"]))


@pytest.mark.parametrize("mcu", ["rp2040", "rp2350"])
@pytest.mark.parametrize("named", [False, True])
def test_running_firmware(mcu, named, make_board, tmp_path, capsys):
    """Touched, mounted by the desktop, written, back on its serial port."""
    board = make_board(mcu)
    board.run_firmware()
    flash(board, make_pico(tmp_path, mcu), str(board.link) if named else "")
    assert_runs(board)
    assert "it is back: %s" % (board.link,) in capsys.readouterr().out


@pytest.mark.parametrize("device", ["", "2e8a:0003", "2E8A:0003"])
def test_boot_loader_that_is_mounted(device, make_board, tmp_path):
    board = make_board()
    board.show_drive()
    while board.next_step:
        board.wait(0)
    flash(board, make_pico(tmp_path), device)
    assert_runs(board)


def test_folder_that_is_named(make_board, tmp_path):
    """Its drive is not in the list of mounts: its file tells when it goes."""
    board = make_board()
    board.automounts = False
    board.show_drive()
    hide = board.hide_drive

    def take_away():
        hide()
        (board.drive / "INFO_UF2.TXT").unlink()
    board.hide_drive = take_away
    flash(board, make_pico(tmp_path), str(board.drive))
    assert_runs(board)


def test_root_mounts_it(make_board, tmp_path, monkeypatch):
    board = make_board()
    board.automounts = False
    add_program(monkeypatch, tmp_path, "mount", '[ "$1 $2 $3" = "-t vfat /dev/sdb1" ]'
                ' && rmdir "$4" && ln -s "%s" "$4"' % (board.drive,))
    add_program(monkeypatch, tmp_path, "umount", '[ "$1" = -l ] && rm "$2" && mkdir'
                ' "$2" && echo "$2" > %s/folder' % (tmp_path,))
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    board.show_drive()
    flash(board, make_pico(tmp_path), "2e8a:0003")
    assert_runs(board)
    folder = (tmp_path / "folder").read_text().strip()
    assert "klippy-" in folder and not os.path.exists(folder)


def test_others_ask_udisks(make_board, tmp_path, monkeypatch):
    board = make_board()
    board.automounts = False
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    add_program(monkeypatch, tmp_path, "udisksctl", "echo Not authorized >&2; exit 1")
    board.show_drive()
    target = make_pico(tmp_path)
    with pytest.raises(PrinterError, match="Not authorized.*sudo make flash"):
        flash(board, target)
    add_program(monkeypatch, tmp_path, "udisksctl", '[ "$4" = /dev/sdb1 ] && '
                "printf '%%s\\n' '/dev/sdb1 %s vfat rw 0 0' >> %s/proc/mounts" % (
                    str(board.drive).replace(" ", "\\040"), board.root))
    flash(board, target)
    assert_runs(board)


def test_firmware_without_usb_is_not_waited_for(make_board, tmp_path, capsys):
    board = make_board()
    board.is_dead = True
    board.show_drive()
    flash(board, make_pico(tmp_path, USBSERIAL="n"))
    assert not board.usb.exists()
    assert "it is back" not in capsys.readouterr().out


# ---- What goes wrong

def test_firmware_that_does_not_come_back(make_board, tmp_path):
    board = make_board()
    board.is_dead = True
    board.show_drive()
    with pytest.raises(PrinterError, match="was written, but its serial port"):
        flash(board, make_pico(tmp_path))


def test_firmware_that_does_not_listen(make_board, tmp_path):
    board = make_board()
    board.is_deaf = True
    board.run_firmware()
    with pytest.raises(PrinterError, match="did not start its boot loader.*BOOTSEL"):
        flash(board, make_pico(tmp_path))


def test_file_that_is_not_taken(make_board, tmp_path):
    board = make_board()
    board.show_drive()
    board.family = 0
    with pytest.raises(PrinterError, match="has not taken the file"):
        flash(board, make_pico(tmp_path))


@pytest.mark.parametrize("mcu, other", [("rp2040", "rp2350"), ("rp2350", "rp2040")])
def test_another_chip(mcu, other, make_board, tmp_path):
    board = make_board(other)
    board.show_drive()
    with pytest.raises(PrinterError, match="has an %s, the firmware is for '%s'"
                       % (other, mcu)):
        flash(board, make_pico(tmp_path, mcu))
    assert not list(board.drive.glob("*.uf2"))


def test_another_kind_of_boot_loader(make_board, tmp_path):
    board = make_board()
    (board.drive / "INFO_UF2.TXT").write_text("UF2 Bootloader\nBoard-ID: SAMD21G18A")
    with pytest.raises(PrinterError, match="another boot loader .*SAMD21"):
        flash(board, make_pico(tmp_path), str(board.drive))


def test_folder_without_boot_loader(make_board, tmp_path):
    with pytest.raises(PrinterError, match=r"is not the drive .*no INFO_UF2\.TXT"):
        flash(make_board(), make_pico(tmp_path), str(tmp_path))


def test_port_that_is_not_there(make_board, tmp_path):
    board = make_board()
    board.run_firmware()
    with pytest.raises(PrinterError, match="There is no '/dev/none'") as caught:
        flash(board, make_pico(tmp_path), "/dev/none")
    assert str(board.link) in str(caught.value)


def test_usb_id_of_something_else(make_board, tmp_path):
    with pytest.raises(PrinterError, match="is no boot loader .*2e8a:0003"):
        flash(make_board(), make_pico(tmp_path), "0483:df11")


def test_boot_loader_without_drive(make_board, tmp_path):
    with pytest.raises(PrinterError, match="shows no drive"):
        flash(make_board(), make_pico(tmp_path), "2e8a:0003")


def test_several_boards_wait(make_board, tmp_path):
    board = make_board()
    board.automounts = False
    board.show_drive()
    second = board.usb.with_name("1-2")
    (second / "1-2:1.0/host3/target3:0:0/3:0:0:0/block/sdc/sdc1").mkdir(parents=True)
    (second / "idVendor").write_text("2e8a\n")
    (second / "idProduct").write_text("0003\n")
    with pytest.raises(PrinterError, match="Several boards") as caught:
        flash(board, make_pico(tmp_path))
    assert "/dev/sdb1" in str(caught.value) and "/dev/sdc1" in str(caught.value)


def test_several_drives_are_mounted(make_board, tmp_path):
    board = make_board()
    board.show_drive()
    board.mount()
    other = tmp_path / "other"
    other.mkdir()
    (other / "INFO_UF2.TXT").write_text("Board-ID: RPI-RP2")
    with open(board.root / "proc/mounts", "a", encoding="utf-8") as file:
        file.write("/dev/sdc1 %s vfat rw 0 0\n" % (other,))
    with pytest.raises(PrinterError, match="choose one") as caught:
        flash(board, make_pico(tmp_path))
    assert "FLASH_DEVICE=%s" % (other,) in str(caught.value)
    flash(board, make_pico(tmp_path), str(board.drive))
    assert_runs(board)


def test_full_drive(make_board, tmp_path, monkeypatch):
    def refuse(fd):
        raise OSError(28, "No space left on device")
    board = make_board()
    board.show_drive()
    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(PrinterError, match="Cannot write .*No space"):
        flash(board, make_pico(tmp_path))


def test_board_that_goes_before_the_last_byte(make_board, tmp_path, monkeypatch):
    def refuse(fd):
        raise OSError(5, "Input/output error")
    board = make_board()
    board.show_drive()
    monkeypatch.setattr(os, "fsync", refuse)
    flash(board, make_pico(tmp_path))
    assert_runs(board)
