# SPDX-License-Identifier: GPL-3.0-or-later
"""The made-up files of scripts/bench_files.py, and a run with one."""

import importlib.util
import itertools
import math
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def load(name):
    """A script as a module."""
    spec = importlib.util.spec_from_file_location(
        name, ROOT / "scripts" / (name + ".py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def bench():
    return load("bench_files")


@pytest.mark.parametrize("name", ["dense", "mixed", "infill"])
def test_moves_are_as_long_as_told(bench, tmp_path, name):
    text = bench.make_pattern(name, tmp_path).read_text()
    points = [tuple(map(float, found)) for found in
              re.findall(r"^G1 X(\S+) Y(\S+) E", text, re.MULTILINE)]
    n_moves, length = bench.PATTERNS[name]
    assert len(points) == n_moves
    lengths = sorted(math.dist(a, b) for a, b in itertools.pairwise(points))
    # the ring sways; lines begin anew at the other end of the bed
    for part in (0.01, 0.5, 0.99):
        found = lengths[int(part * len(lengths))]
        assert found == pytest.approx(length, rel=0.06)


def test_run_of_a_file(bench, tmp_path):
    dictionary = ROOT / "out-simulator" / "klipper.dict"
    config, job = tmp_path / "printer.cfg", tmp_path / "job.gcode"
    config.write_text("[mcu]\nserial: /dev/null\n[printer]\nkinematics: none\n"
                      "max_velocity: 100\nmax_accel: 100\n")
    job.write_text("M118 done\n")
    user, _, memory, size, wall = bench.run(config, job, dictionary, tmp_path)
    assert user > 0. and memory > 5. and size > 0 and wall > 0.
    config.write_text("[nonsense]\n")
    with pytest.raises(SystemExit, match="failed"):
        bench.run(config, job, dictionary, tmp_path)


CALLGRIND = """\
positions: line
events: Ir
ob=(1) /usr/lib/libc.so
fl=(1) a.c
fn=(1) main
12 100
+3 20
cob=(2) /x/libklippyc.so
cfn=(2) solve
calls=3 40
* 5000
-2 7

ob=(2)
fl=(2) b.c
fn=(2)
40 4000
fi=(3) pair.h
+1 1000
totals: 5127
"""


def test_instructions_by_object(monkeypatch):
    """What a function called took is told where that is, and not twice."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    counts = load("bench_table").sum_objects(CALLGRIND.splitlines(keepends=True))
    assert counts == {"/usr/lib/libc.so": 127, "/x/libklippyc.so": 5000}
