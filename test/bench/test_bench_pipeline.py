# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole way of a move: from a line of text to encoded messages in a file.

Times are those of whole host processes, less that of one with an empty job.
"""

import pathlib
import re
import shutil
import subprocess
import sys
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
DICTIONARY = ROOT / "out-simulator" / "klipper.dict"
JOB = ROOT / "config" / "samples" / "vase_s.gcode"


def make_config(folder):
    """The sample printer with the pin names of a simulated mcu."""
    text = (ROOT / "config" / "sample-cartesian.cfg").read_text()
    pins = {}

    def rename(match):
        return pins.setdefault(match.group(0), "gpio%d" % (len(pins),))

    path = folder / "printer.cfg"
    path.write_text(re.sub(r"\bP[A-L]\d\b", rename, text))
    return path


def make_job(folder, name, lines):
    path = folder / name
    path.write_text("\n".join(["G28", *lines]) + "\n")
    return path


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    """(command without job, empty job, job, moves of that)."""
    folder = tmp_path_factory.mktemp("pipeline")
    lines = [line for line in JOB.read_text().splitlines()
             if re.match(r"G[01] |G9[02]|M8[23]", line)]
    command = [sys.executable, str(ROOT / "klippy" / "klippy.py"),
               str(make_config(folder)), "-o", str(folder / "out.serial"),
               "-d", str(DICTIONARY), "-l", str(folder / "log"), "-i"]
    moves = sum(1 for line in lines if re.match(r"G[01] .*[XYZE]", line))
    return (command, make_job(folder, "empty.gcode", []),
            make_job(folder, "job.gcode", lines), moves)


def run(command):
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def test_moves_a_second(benchmark, jobs):
    command, empty, job, moves = jobs
    idle = min(run([*command, str(empty)]) for _ in range(3))
    benchmark.pedantic(run, args=([*command, str(job)],), rounds=5)
    elapsed = benchmark.stats.stats.min - idle
    benchmark.extra_info["moves/s"] = round(moves / elapsed)
    print("full pipeline: %d moves in %.3f s: %d moves/s, %.2f us a move"
          % (moves, elapsed, moves / elapsed, elapsed / moves * 1e6))


def count_instructions(command, folder):
    out = folder / "callgrind.out"
    subprocess.run(["valgrind", "--tool=callgrind",
                    "--callgrind-out-file=%s" % (out,), *command],
                   check=True, capture_output=True)
    return int(re.search(r"^(?:totals|summary): (\d+)", out.read_text(),
                         re.MULTILINE).group(1))


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_instructions_a_move(jobs, tmp_path):
    command, empty, job, moves = jobs
    idle = count_instructions([*command, str(empty)], tmp_path)
    total = count_instructions([*command, str(job)], tmp_path)
    print("full pipeline: %d instructions a move" % ((total - idle) // moves,))
    assert total > idle
