# SPDX-License-Identifier: GPL-3.0-or-later
"""The assembler of PIO programs, and that can_program.h is what it makes."""

import importlib.util
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPEC = importlib.util.spec_from_file_location(
    "pio_assemble", ROOT / "scripts" / "pio_assemble.py")
pio_assemble = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(pio_assemble)


@pytest.mark.parametrize("line, word", [
    ("jmp 0", None), ("jmp x-- here", 0x0040), ("jmp pin here", 0x00C0),
    ("wait 1 pin 0", 0x20A0), ("wait 0 gpio 4", 0x2004), ("in pins, 1", 0x4001),
    ("in null, 32", 0x4060), ("out pins, 1", 0x6001), ("out x, 32", 0x6020),
    ("push block", 0x8020), ("push noblock", 0x8000), ("pull block", 0x80A0),
    ("pull ifempty noblock", 0x80C0), ("mov x, y", 0xA022), ("mov y, ~null", 0xA04B),
    ("mov isr, ::osr", 0xA0D7), ("nop", 0xA042), ("set pindirs, 1", 0xE081),
    ("set y, 31", 0xE05F), ("set x, 32", None), ("irq 0", None), ("in pins, 33", None),
    ("push somehow", None)])
def test_instructions(line, word):
    text = "here:\n" + line
    if word is None:
        with pytest.raises(pio_assemble.AssembleError):
            pio_assemble.assemble(text)
    else:
        assert pio_assemble.assemble(text)[0] == [word]


def test_program_of_the_data_sheet():
    """Square wave: RP2040 data sheet, 3.2.1."""
    words, places = pio_assemble.assemble("""
.program squarewave
    set pindirs, 1      ; the pin is an output
public again:
    set pins, 1 [1]
    set pins, 0
    jmp again
""")
    assert words == [0xE081, 0xE101, 0xE000, 0x0001]
    assert places == {"name": "squarewave", "again": 1}


def test_too_long():
    with pytest.raises(pio_assemble.AssembleError):
        pio_assemble.assemble("nop\n" * 33)


def test_header_is_up_to_date():
    """Made anew, src/rp2040/can_program.h is the same."""
    source = ROOT / "src/rp2040/can.pio"
    words, places = pio_assemble.assemble(source.read_text())
    assert len(words) <= 32 and places["wrap_target"] == 0
    assert pio_assemble.write_header(words, places, source.name) == (
        ROOT / "src/rp2040/can_program.h").read_text()
