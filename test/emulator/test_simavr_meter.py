# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles of an emulated AVR chip: of a program that was counted by hand, and
ceilings for the firmware a bit above what `make bench-firmware` prints."""

import subprocess

import pytest
import simavr_chip
import step_bench
from simavr_board import AvrBoard
from simboard import SimBoard

pytestmark = [
    pytest.mark.emulator,
    pytest.mark.skipif(not simavr_chip.is_installed(), reason="needs libsimavr-dev")]

MHZ = 16
N_OFF, N_IRQ, PERIOD = 21, 30, 1000
# The timer's registers of an atmega2560, and vectors 17 (compare A) and 0
PROGRAM = """
    .org 0
        jmp start
    .org 17 * 4
        jmp handler
    .org 0x200
    start:
        ldi r16, 1
        out 0x33, r16           ; SMCR: sleep means idle
        ldi r16, hi8(%(period)d - 1)
        sts 0x89, r16           ; OCR1A
        ldi r16, lo8(%(period)d - 1)
        sts 0x88, r16
        ldi r16, 2
        sts 0x6f, r16           ; TIMSK1: compare A
        ldi r16, 0x09
        sts 0x81, r16           ; TCCR1B: starts anew at OCR1A
        sei
    again:
        sleep
        cli
        .rept %(n_off)d
        nop
        .endr
        sei
        rjmp again
    handler:
        .rept %(n_irq)d
        nop
        .endr
        reti
"""
# By the instruction set manual, on a chip whose program counter has 22 bits
SEI, RETI, ENTRY, JMP, RJMP, CLI, SLEEP = 1, 5, 5, 3, 2, 1, 1


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    return simavr_chip.build_adapter(tmp_path_factory.mktemp("simavr"))


def assemble(folder):
    source, elf = folder / "counted.s", folder / "counted.elf"
    source.write_text(PROGRAM % dict(n_off=N_OFF, n_irq=N_IRQ, period=PERIOD))
    subprocess.run(["avr-gcc", "-mmcu=atmega2560", "-nostdlib", "-o", str(elf),
                    str(source)], check=True)
    return elf


def test_cycles_of_a_counted_program(adapter, tmp_path, monkeypatch):
    simavr_chip.choose_chip(monkeypatch, assemble(tmp_path), "atmega2560")
    board = SimBoard(adapter)
    AvrBoard.read_delays(board)
    awake = AvrBoard.read_stats(board)[0]
    n_periods = 1000
    board.run_for(n_periods * PERIOD / board.freq)
    awake = (AvrBoard.read_stats(board)[0] - awake) / n_periods
    off, irq = N_OFF + SEI, ENTRY + JMP + N_IRQ + RETI
    assert AvrBoard.read_delays(board) == (off, irq)
    assert awake == pytest.approx(irq + CLI + off + RJMP, abs=SLEEP + 1)
    board.ops.power_off()


# Cycles: of a debug_nop, with interrupts off, in one interrupt
@pytest.mark.parametrize("config, nop, off, irq", [
    ("atmega2560", 450, 200, 1550),
    pytest.param("atmega328p", 450, 200, 1550, marks=pytest.mark.slow)])
def test_ceilings(config, nop, off, irq, adapter):
    line, = (n for n in step_bench.AVR_LINES if n.config == config)
    bench = step_bench.AvrBench(line, adapter)
    delays = bench.measure_delays()
    assert delays[0] <= off and delays[1] <= irq, delays
    assert bench.measure_nop() <= nop
