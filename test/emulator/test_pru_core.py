# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated core runs what the assembler makes, as the manual says."""

import ctypes
import shutil
import struct
import subprocess

import firmware_matrix
import pru_board
import pytest

TOOLS = firmware_matrix.find_prefix("pru") or "pru-elf-"
pytestmark = [pytest.mark.emulator,
              pytest.mark.skipif(not shutil.which(TOOLS + "as"),
                                 reason="needs pru-elf-as")]

STORE = "    sbbo &r%d, r2, 0, 4\n    add r2, r2, 4\n"


@pytest.fixture(scope="module")
def adapter(tmp_path_factory):
    library = ctypes.CDLL(str(pru_board.build_adapter(tmp_path_factory.mktemp("pru"))))
    library.pru_run_program.restype = ctypes.POINTER(ctypes.c_uint8)
    library.pru_read_cycles.restype = ctypes.c_uint64
    return library


@pytest.fixture
def run(adapter, tmp_path):
    """run(source, n): words 0.. that a program has stored, None if it failed."""
    def run(source, n_words, n_max=10000):
        text = tmp_path / "test.s"
        text.write_text(".global start\nstart:\n    ldi r2, 0\n%s\n    halt\n"
                        % (source,))
        subprocess.run([TOOLS + "as", "-o", tmp_path / "test.o", text], check=True)
        subprocess.run([TOOLS + "ld", "-e", "start", "-Ttext=0x20000000",
                        "-o", tmp_path / "test.elf", tmp_path / "test.o"], check=True)
        data = adapter.pru_run_program(str(tmp_path / "test.elf").encode(), n_max)
        return list(struct.unpack("<%dI" % (n_words,), bytes(data[:4 * n_words]))) \
            if data else None
    return run


def load(reg, value):
    return "    ldi32 r%d, 0x%x\n" % (reg, value)


@pytest.mark.parametrize("operation, a, b, result", [
    ("add", 0xFFFFFFFF, 2, 1), ("sub", 1, 2, 0xFFFFFFFF), ("rsb", 2, 1, 0xFFFFFFFF),
    ("lsl", 0x80000001, 33, 2), ("lsr", 0x80000001, 4, 0x08000000),
    ("and", 0xF0F0F0F0, 0xFF00FF00, 0xF000F000), ("or", 0xF0, 0x0F, 0xFF),
    ("xor", 0xFF, 0x0F, 0xF0), ("min", 0x80000000, 3, 3),
    ("max", 0x80000000, 3, 0x80000000), ("clr", 0xFF, 7, 0x7F), ("set", 0, 31, 1 << 31),
    ("lmbd", 0x00800000, 1, 23), ("lmbd", 0, 1, 32), ("lmbd", 0xFFFFFFFF, 0, 32)])
def test_arithmetic(operation, a, b, result, run):
    source = load(5, a) + load(6, b) + "    %s r7, r5, r6\n" % (operation,)
    assert run(source + STORE % (7,), 1) == [result]


def test_carry_comes_out_of_the_result(run):
    source = (load(5, 0xFFFFFFFF) + load(6, 0) + load(7, 0) + load(8, 255)
              + "    add r5, r5, 1\n    adc r6, r6, 0\n"
              "    add r8.b0, r8.b0, 1\n    adc r7, r7, 0\n"
              "    sub r5, r5, 1\n    suc r5, r5, 0\n")
    assert run(source + "".join(STORE % (reg,) for reg in (5, 6, 7)), 3) == [
        0xFFFFFFFE, 1, 1]


def test_fields_of_registers(run):
    source = (load(5, 0x44332211) + load(6, 0) + "    mov r6.b1, r5.b2\n"
              "    mov r7, r5.w1\n    ldi r5.w2, 0xabcd\n    not r8, r5.b0\n")
    assert run(source + "".join(STORE % (reg,) for reg in (5, 6, 7, 8)), 4) == [
        0xABCD2211, 0x3300, 0x3322, 0xFFFFFFEE]


@pytest.mark.parametrize("branch, taken", [
    ("qbgt", [0, 0, 1]), ("qbge", [0, 1, 1]), ("qblt", [1, 0, 0]),
    ("qble", [1, 1, 0]), ("qbeq", [0, 1, 0]), ("qbne", [1, 0, 1])])
def test_branches_compare_the_other_way_round(branch, taken, run):
    """qbgt: the second operand is greater than the first."""
    source = ""
    for number, value in enumerate((0x80000000, 7, 6)):
        source += (load(5, value) + "    ldi r7, 1\n    %s there%d, r5, 7\n"
                   "    ldi r7, 0\nthere%d:\n" % (branch, number, number)
                   + STORE % (7,))
    assert run(source, 3) == taken


def test_bits_and_calls(run):
    source = """
    ldi r5, 4
    ldi r7, 0
    qbbs first, r5, 2
    ldi r7, 99
first:
    qbbc second, r5, 2
    add r7, r7, 1
second:
    jal r3.w2, function
    add r7, r7, 16
    qba done
function:
    add r7, r7, 2
    jmp r3.w2
done:
"""
    assert run(source + STORE % (7,), 1) == [1 + 2 + 16]


@pytest.mark.parametrize("count, result", [("5", 5), ("r6", 3), ("r8", 0)])
def test_loops(count, result, run):
    source = load(6, 3) + load(8, 0) + """
    ldi r7, 0
    loop end, %s
    add r7, r7, 1
end:
""" % (count,)
    assert run(source + STORE % (7,), 1) == [result]


def test_bursts(run):
    source = ("".join(load(5 + i, 0x11111111 * (i + 1)) for i in range(3))
              + "    ldi r20, 0x40\n    sbbo &r5, r20, 4, 12\n"
              "    lbbo &r10.b1, r20, 7, 2\n    ldi r0.b0, 8\n"
              "    lbbo &r21, r20, 8, r0.b0\n    mov r10.b0, r10.b1\n"
              "    mov r10.w2, r10.w0\n")
    assert run(source + "".join(STORE % (reg,) for reg in (10, 21, 22)), 3) == [
        0x11111111, 0x22222222, 0x33333333]


def test_multiplier(run):
    source = (load(28, 0x12345678) + load(29, 0x9ABCDEF0)
              + "    nop\n    xin 0, r26, 8\n")
    product = 0x12345678 * 0x9ABCDEF0
    assert run(source + STORE % (26,) + STORE % (27,), 2) == [
        product & 0xFFFFFFFF, product >> 32]


def test_wide_constants(run):
    source = load(5, 7) + load(6, 7) + "    zero &r5, 4\n    fill &r6, 4\n"
    assert run(source + STORE % (5,) + STORE % (6,), 2) == [0, 0xFFFFFFFF]


def test_what_time_takes(run, adapter):
    """Loads of memory wait for two cycles, of the counter for eleven."""
    assert run("    lbbo &r5, r2, 0, 4\n", 0) == []
    local = adapter.pru_read_cycles()
    assert run("    ldi32 r6, 0x2e000\n    lbbo &r5, r6, 0xc, 4\n", 0) == []
    assert local == 1 + 3 + 1 and adapter.pru_read_cycles() == 1 + 2 + 12 + 1


@pytest.mark.parametrize("source", [
    "    ldi32 r6, 0x44e07000\n    lbbo &r5, r6, 0, 4\n",    # no bus master
    "    ldi32 r6, 0x50000\n    lbbo &r5, r6, 0, 4\n",       # nothing there
    "    jmp r2.w0\nend: .word 0xa0000000\n",               # endless
])
def test_what_silicon_would_not_do(source, run):
    assert run(source, 0) is None
