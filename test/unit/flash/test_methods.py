# SPDX-License-Identifier: GPL-3.0-or-later
"""Firmware into boards: by the real programs, to boot loaders on a terminal."""

import shutil

import pytest
from pty_board import ArduinoBoard, Stm32Board

from klippy import cli
from klippy.errors import PrinterError
from klippy.flash import methods, tools
from klippy.flash.target import read_target

IMAGE = bytes((i * 7 + i // 256) & 0xFF for i in range(3000))


def make_target(folder, **options):
    lines = ['CONFIG_%s="%s"' % item if not str(item[1]).isalnum()
             else "CONFIG_%s=%s" % item for item in options.items()]
    (folder / "auto.conf").write_text("\n".join(lines) + "\n")
    (folder / "klipper.bin").write_bytes(IMAGE)
    return read_target(folder)


def write_hex(path, data):
    """Intel hex records of 16 bytes."""
    lines = []
    for i in range(0, len(data), 16):
        part = data[i:i + 16]
        record = bytes([len(part), i >> 8, i & 0xFF, 0]) + part
        lines.append(":" + (record + bytes([-sum(record) & 0xFF])).hex().upper())
    path.write_text("\n".join([*lines, ":00000001FF"]) + "\n")


@pytest.fixture
def arduino():
    board = ArduinoBoard()
    board.start()
    yield board
    board.close()


@pytest.fixture
def stm32():
    board = Stm32Board()
    board.start()
    yield board
    board.close()


@pytest.mark.skipif(not shutil.which("avrdude"), reason="needs avrdude")
def test_avrdude_writes_and_verifies(arduino, tmp_path):
    target = make_target(tmp_path, BOARD_DIRECTORY="avr", MCU="atmega328p",
                         AVRDUDE_PROTOCOL="arduino")
    write_hex(tmp_path / "klipper.elf.hex", IMAGE)
    methods.flash(target, arduino.path)
    assert bytes(arduino.memory[:len(IMAGE)]) == IMAGE
    assert arduino.left


@pytest.mark.skipif(not shutil.which("avrdude"), reason="needs avrdude")
def test_avrdude_refuses_another_chip(arduino, tmp_path, capsys):
    make_target(tmp_path, BOARD_DIRECTORY="avr", MCU="atmega2560",
                AVRDUDE_PROTOCOL="arduino")
    write_hex(tmp_path / "klipper.elf.hex", IMAGE)
    status = cli.main(["firmware", "flash", "--out", str(tmp_path),
                       "--device", arduino.path])
    assert status == 1
    assert "'avrdude' failed" in capsys.readouterr().err
    assert bytes(arduino.memory[:16]) == b"\xff" * 16


@pytest.mark.skipif(not shutil.which("stm32flash"), reason="needs stm32flash")
def test_stm32flash_writes_and_verifies(stm32, tmp_path, monkeypatch):
    # a pseudo terminal has no parity
    monkeypatch.setenv("FLASH_ARGS", "-m 8n1")
    target = make_target(tmp_path, BOARD_DIRECTORY="stm32", MCU="stm32f103xe",
                         FLASH_APPLICATION_ADDRESS="0x8002000", SERIAL="y")
    methods.flash(target, stm32.path)
    assert bytes(stm32.memory[0x2000:0x2000 + len(IMAGE)]) == IMAGE
    assert bytes(stm32.memory[:0x2000]) == b"\xff" * 0x2000
    assert stm32.started.wait(5)  # stm32flash does not
    assert stm32.started_at == 0x8002000


def test_linux_installs(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "bin").mkdir()
    target = make_target(out, BOARD_DIRECTORY="linux", MCU="linux")
    (out / "klipper.elf").write_bytes(b"program")
    methods.flash(target, str(tmp_path))
    assert (tmp_path / "bin/klipper_mcu").read_bytes() == b"program"


def test_missing_program_names_its_package(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(PrinterError, match="apt-get install bossa-cli"):
        tools.find_tool("bossac")


def test_unbuilt_firmware(tmp_path, capsys):
    assert cli.main(["firmware", "flash", "--out", str(tmp_path)]) == 1
    assert "build it first" in capsys.readouterr().err


def test_lists_what_there_is(capsys):
    assert cli.main(["firmware", "list"]) == 0
    assert capsys.readouterr().out


def test_build_needs_source(tmp_path, capsys):
    assert cli.main(["firmware", "build", "--source", str(tmp_path)]) == 1
    assert "no source code" in capsys.readouterr().err
