# SPDX-License-Identifier: GPL-3.0-or-later
"""The soak, short and long, and that its judges see what they are to see."""
import logging
import pathlib
import subprocess
import sys

import pytest
from soak_gauges import Gauges
from soak_jobs import find_end, make_job, make_sliced
from soak_log import LogJudge

SOAK = pathlib.Path(__file__).resolve().parent / "soak.py"


def run_soak(hours, n_jobs, seed, folder, timeout):
    folder.mkdir()
    result = subprocess.run(
        [sys.executable, str(SOAK), "--hours", str(hours), "--jobs", str(n_jobs),
         "--seed", str(seed), "--folder", str(folder)],
        capture_output=True, text=True, timeout=timeout, check=False)
    assert result.returncode == 0, result.stdout[-6000:] + result.stderr[-2000:]
    return result.stdout


def test_short_soak(tmp_path):
    """Some minutes of a printer's life."""
    told = run_soak(0.08, 4, 11, tmp_path / "printer", 300)
    assert "4 jobs in" in told and told.rstrip().endswith("faults:     0")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_long_soak(tmp_path, seed):
    """A day of it, with 200 jobs."""
    told = run_soak(24., 200, seed, tmp_path / "printer", 7200)
    assert "200 jobs in" in told and told.rstrip().endswith("faults:     0")


# The judges

def test_log_judge_keeps_what_nothing_explains():
    judge = LogJudge(["always"])
    logger = logging.Logger("soak")
    logger.addHandler(judge)
    logger.warning("this comes always")
    logger.error("a cable was cut")
    judge.begin("job 2", ["cable was cut"])
    logger.error("a cable was cut")
    logger.info("no error")
    try:
        raise ValueError("within")
    except ValueError:
        logger.exception("a surprise")
    judge.end()
    logger.error("a cable was cut")
    assert [step for step, _ in judge.unexplained] == [None, "job 2", None]
    assert "within" in judge.unexplained[1][1] and judge.n_explained == 2


@pytest.fixture
def gauges(monkeypatch):
    from klippy.cli import run
    monkeypatch.setattr(run, "Printer", run.Printer)
    return Gauges()


def fill(gauges, leak_kb=0, leak_fds=0, leak_objects=0, leak_printers=0):
    for index in range(40):
        gauges.at_jobs.append((index, 100. * index, 60000 + leak_kb * index,
                               17 + leak_fds * index // 40, 2))
    for index in range(12):
        gauges.at_boots.append({"printers": leak_printers * index,
                                "objects": 40000 + leak_objects * index})


@pytest.mark.parametrize("leak,told", [
    ({}, None), ({"leak_kb": 20}, None), ({"leak_kb": 150}, "memory grows"),
    ({"leak_fds": 4}, "descriptors grow"), ({"leak_printers": 1}, "more printers"),
    ({"leak_objects": 500}, "more objects")])
def test_gauges_see_a_leak(gauges, leak, told):
    fill(gauges, **leak)
    found = gauges.find_growth(2.0)
    assert (told in "\n".join(found)) if told else not found


def test_gauges_read_the_process(gauges):
    gauges.note_job(1, 0.)
    gauges.note_boot()
    number, _, rss, descriptors, threads = gauges.at_jobs[0]
    assert number == 1 and rss > 10000 and descriptors > 2 and threads >= 1
    assert gauges.at_boots[0]["objects"] > 1000


def test_end_of_a_file():
    lines = ["G28", "G1 X5 Y6.5 Z1 ; X9", "G2 X7 I1 J1", "M104 S200", "G1 E4 F600",
             "G91", "G1 Z2", "G90", "G0 Y3"]
    assert find_end(lines) == {"X": 7.0, "Y": 3.0, "Z": 3.0}


def test_jobs_are_the_same_for_a_seed():
    import random
    jobs = [make_job(random.Random(3), number, 60.) for number in (2, 2)]
    assert jobs[0] == jobs[1] and jobs[0].end
    assert make_sliced(random.Random(1)).end.keys() == {"X", "Y", "Z"}
