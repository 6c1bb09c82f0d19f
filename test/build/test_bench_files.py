# SPDX-License-Identifier: GPL-3.0-or-later
"""The made-up files of scripts/bench_files.py, and a run with one."""

import importlib.util
import itertools
import math
import pathlib
import re
import shutil

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


@pytest.fixture
def table(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return load("bench_table")


def test_each_job_has_a_file_of_its_own(table, tmp_path):
    """The one that does nothing is made while others are measured."""
    vase = table.make_job("vase_s at 0", tmp_path)
    size = vase.stat().st_size
    assert table.make_job("nothing", tmp_path).read_text() == "M115\n"
    assert vase.stat().st_size == size > 100000


@pytest.mark.parametrize("counted, error", [
    (7, "9 bytes when timed, but 7 when counted"), (9, None)])
def test_a_counted_run_that_ended_early(table, tmp_path, monkeypatch, counted, error):
    (tmp_path / "out.serial").write_bytes(b"x" * counted)
    job = tmp_path / "job.gcode"
    job.write_text("M115\n" * 10)
    counts = iter([(10, 100), (2010, 20100)])
    monkeypatch.setattr(table, "count_instructions", lambda *_: next(counts))
    args = "printer.cfg", job, "klipper.dict", tmp_path
    if error:
        with pytest.raises(SystemExit, match=error):
            table.split_instructions(args, 9, 100, tmp_path)
    else:
        assert table.split_instructions(args, 9, 100, tmp_path) == (
            pytest.approx(22.11e-6), 2., 20.)


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="needs valgrind")
def test_a_counted_run_that_failed(table, tmp_path):
    with pytest.raises(SystemExit, match="failed by callgrind"):
        table.count_instructions(["false"], tmp_path)


def test_instructions_by_object(table):
    """What a function called took is told where that is, and not twice."""
    counts = table.sum_objects(CALLGRIND.splitlines(keepends=True))
    assert counts == {"/usr/lib/libc.so": 127, "/x/libklippyc.so": 5000}
