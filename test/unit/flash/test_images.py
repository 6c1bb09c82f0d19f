# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that boot loaders read: UF2 drives and SD cards."""

import struct

import pytest

from klippy.errors import PrinterError
from klippy.flash import boards, methods, sdcard, uf2
from klippy.flash.target import Target

IMAGE = bytes(i * 11 & 0xFF for i in range(40000))


def make_target(tmp_path, family, mcu, **options):
    (tmp_path / "klipper.bin").write_bytes(IMAGE)
    return Target(tmp_path, {"BOARD_DIRECTORY": family, "MCU": mcu, **options})


def test_uf2_blocks():
    image = uf2.convert(IMAGE, 0x10004000, uf2.FAMILIES["rp2040"])
    assert len(image) == 512 * 157
    data = b""
    for i in range(157):
        block = image[512 * i:512 * (i + 1)]
        words = struct.unpack("<8I", block[:32])
        assert words == (0x0A324655, 0x9E5D5157, 0x2000, 0x10004000 + 256 * i, 256, i,
                         157, 0xE48BFF56)
        assert block[-4:] == struct.pack("<I", 0x0AB16F30)
        data += block[32:288]
    assert data[:len(IMAGE)] == IMAGE and not any(data[len(IMAGE):])


def test_card_has_the_name_of_the_board(tmp_path):
    card = tmp_path / "card"
    card.mkdir()
    target = make_target(tmp_path, "lpc176x", "lpc1768")
    (card / "FIRMWARE.CUR").write_bytes(b"old")
    methods.flash(target, str(card), "btt-skr-v1.3")
    assert (card / "firmware.bin").read_bytes() == IMAGE
    assert not (card / "FIRMWARE.CUR").exists()
    with pytest.raises(PrinterError, match="The board has an lpc1769"):
        methods.flash(target, str(card), "btt-skr-turbo-v1.4")
    with pytest.raises(PrinterError, match="Unknown board 'nobody'"):
        methods.flash(target, str(card), "nobody")
    with pytest.raises(PrinterError, match="mounted card"):
        methods.flash(target, str(tmp_path / "none"), "btt-skr-v1.3")


def test_card_for_robin_is_encoded(tmp_path):
    card = tmp_path / "card"
    card.mkdir()
    target = make_target(tmp_path, "stm32", "stm32f103xe")
    path = sdcard.write(target, "mks-robin-e3", card)
    data = path.read_bytes()
    assert path.name == "Robin_e3.bin" and len(data) == len(IMAGE)
    assert data[:320] == IMAGE[:320] and data[31040:] == IMAGE[31040:]
    assert data[320] == IMAGE[320] ^ 0xA3 and data[351] == IMAGE[351] ^ 0x3E
    assert sdcard.encode(data, "mks-robin") == IMAGE


def test_unknown_encoding_is_refused(tmp_path):
    card = tmp_path / "card"
    card.mkdir()
    target = make_target(tmp_path, "stm32", "stm32f103xe")
    with pytest.raises(PrinterError, match="encoding 'chitu'"):
        sdcard.write(target, "chitu-v6", card)
    assert not list(card.iterdir())


def test_some_boards_want_a_new_name_each_time():
    board = sdcard.find_board("creality-v4.2.7")
    names = {sdcard.choose_name(board, now) for now in (1e9, 1e9 + 1)}
    assert len(names) == 2 and all(name.endswith(".bin") for name in names)


def test_aliases_lead_to_boards():
    assert set(boards.ALIASES.values()) <= set(boards.BOARDS)
    for name in [*boards.BOARDS, *boards.ALIASES]:
        assert {"mcu", "file", "done", "unique"} <= set(sdcard.find_board(name))
