# SPDX-License-Identifier: GPL-3.0-or-later
"""The model of a PIO block: by the data sheet's words, and against rp2040js.

rp2040js is used where it is installed (see test_rp2040js.py).
"""

import ctypes
import importlib.util
import json
import pathlib
import random
import shutil
import subprocess

import pytest
from test_rp2040js import PACKAGE

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "test" / "emulator"
SPEC = importlib.util.spec_from_file_location(
    "pio_assemble", ROOT / "scripts" / "pio_assemble.py")
pio_assemble = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(pio_assemble)

pytestmark = pytest.mark.emulator

FSTAT, TXF, RXF, MEMORY, SM0 = 0x04, 0x10, 0x20, 0x48, 0xC8
RX, TX = 4, 5
DRIVER = """
#include <stdlib.h>
#include "unicorn_pio.h"
static struct pio pio;
static const char *trouble;
static void note(const char *what) { trouble = what; }
void begin(void) { trouble = NULL; pio_reset(&pio, false, note); }
void put(uint32_t offset, uint32_t value) { pio_write(&pio, offset, value); }
uint32_t get(uint32_t offset) { return pio_read(&pio, offset); }
void step(uint32_t pads) { pio_step(&pio, pads); }
uint32_t out(void) { return pio.out; }
uint32_t is_idle(void) { return pio_is_idle(&pio); }
const char *fault(void) { return trouble; }
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pio")
    (folder / "driver.c").write_text(DRIVER)
    subprocess.run(["cc", "-std=gnu11", "-O2", "-shared", "-fPIC", "-Wall", "-Werror",
                    "-I", str(FOLDER), str(folder / "driver.c"),
                    str(FOLDER / "unicorn_pio.c"), "-o", str(folder / "pio.so")],
                   check=True)
    loaded = ctypes.CDLL(str(folder / "pio.so"))
    loaded.fault.restype = ctypes.c_char_p
    return loaded


def load(library, words, wrap, divider=1):
    library.begin()
    for i, word in enumerate(words):
        library.put(MEMORY + 4 * i, word)
    library.put(SM0, int(divider * 256) << 8)
    library.put(SM0 + 4, RX << 24 | wrap[1] << 12 | wrap[0] << 7)
    library.put(SM0 + 8, 1 << 19)
    library.put(SM0 + 20, 1 << 26 | 1 << 20 | RX << 15 | TX << 5 | TX)


def list_edges(library, cycles, pads=2**32 - 1):
    edges, level = [], library.out() >> TX & 1
    for cycle in range(cycles):
        library.step(pads)
        if library.out() >> TX & 1 != level:
            level ^= 1
            edges.append(cycle)
    return edges


@pytest.mark.parametrize("divider, period", [(1, 8), (4, 32), (2.5, 20)])
def test_delays_and_divider(divider, period, library):
    words, _ = pio_assemble.assemble(
        "start:\nset pins, 1 [3]\nset pins, 0 [2]\njmp start\n")
    load(library, words, (0, 31), divider)
    library.put(0, 1)
    edges = list_edges(library, 10 * period + 4)
    assert edges[2] - edges[0] == pytest.approx(period, abs=1)
    assert edges[18] - edges[0] == pytest.approx(9 * period, abs=1)
    assert edges[1] - edges[0] == pytest.approx(period / 2, abs=1)


def test_queues_stall_and_drop(library):
    """A pull waits for a word; a push into a full queue that does not wait drops."""
    words, _ = pio_assemble.assemble("pull block\nmov isr, osr\npush noblock\n")
    load(library, words, (0, 2))
    library.put(0, 1)
    for value in range(7):
        library.put(TXF, value)
        for _ in range(5):
            library.step(0)
    assert library.get(FSTAT) & 1           # full
    assert [library.get(RXF) for _ in range(4)] == [0, 1, 2, 3]
    assert library.get(FSTAT) >> 8 & 1      # empty
    assert library.fault() is None
    library.get(RXF)
    assert library.fault()


def test_wait_sees_a_pin_two_cycles_later(library):
    words, _ = pio_assemble.assemble("wait 0 pin 0\nset pins, 1\n")
    load(library, words, (1, 1))
    library.put(0, 1)
    assert list_edges(library, 20) == [] and library.is_idle()
    assert list_edges(library, 20, 0) == [3]


def make_wave(rng, bits):
    """Levels of each cycle: bits of 49 to 51 cycles, never six alike."""
    levels, run, level = [1] * 60, 0, 1
    for _ in range(bits):
        flip = run == 5 or rng.random() < 0.5
        level, run = (1 - level, 1) if flip else (level, run + 1)
        levels += [level] * rng.randint(49, 51)
    return levels


def run_model(library, words, places, levels, queue):
    load(library, words, (places["wrap_target"], places["wrap"]))
    library.put(SM0 + 16, 0xE001)
    library.put(SM0 + 16, places["blind"])
    queue = list(queue)
    library.put(TXF, queue.pop(0))
    library.put(0, 1)
    samples, edges, level = [], [], 1
    for cycle in range(len(levels) - 2):
        # (two cycles until the program sees a level)
        library.step(levels[cycle + 2] << RX)
        if library.out() >> TX & 1 != level:
            level ^= 1
            edges.append([cycle, level])
        if not library.get(FSTAT) >> 8 & 1:
            samples.append(library.get(RXF))
            library.put(TXF, queue.pop(0))
    assert library.fault() is None
    return samples, edges


@pytest.mark.skipif(not shutil.which("node") or not PACKAGE.exists(),
                    reason="needs node and rp2040js (see test_rp2040js.py)")
@pytest.mark.parametrize("seed", range(4))
def test_can_program_in_both(seed, library, tmp_path):
    """The bits of CAN: the same samples, and edges at the same cycles."""
    rng = random.Random(seed)
    words, places = pio_assemble.assemble((ROOT / "src/rp2040/can.pio").read_text())
    levels = make_wave(rng, 300)
    queue = [2 | rng.choice([0, 1, 4, 5]) for _ in range(400)]
    samples, edges = run_model(library, words, places, levels, queue)
    job = tmp_path / "job.json"
    job.write_text(json.dumps({
        "program": words, "wrap": [places["wrap_target"], places["wrap"]],
        "start": places["blind"], "rx": RX, "tx": TX, "levels": levels,
        "words": queue}))
    theirs = json.loads(subprocess.run(
        ["node", str(FOLDER / "rp2040js_pio.js"), str(PACKAGE), str(job)],
        capture_output=True, text=True, check=True, timeout=60).stdout)
    assert len(samples) > 280 and len(edges) > 50
    n = min(len(samples), len(theirs["samples"]))
    assert n > 280 and samples[:n] == theirs["samples"][:n]
    n = min(len(edges), len(theirs["edges"]))
    assert n > 50
    off = {mine[0] - other[0] for mine, other in
           zip(edges[:n], theirs["edges"][:n], strict=True)}
    assert [e[1] for e in edges[:n]] == [e[1] for e in theirs["edges"][:n]]
    assert max(off) - min(off) <= 1, off
