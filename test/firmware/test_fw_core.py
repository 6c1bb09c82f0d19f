# SPDX-License-Identifier: GPL-3.0-or-later
"""C tests of the firmware's core on the fake board, under sanitizers."""

import os
import subprocess
import sys

import pytest
from simboard import ROOT

OUT = "out/test-fakeboard/"
INTERLEAVE_OUT = "out/test-interleave/"


def build(out, *variables):
    """Bring a program of the fake board up to date."""
    env = dict(os.environ, KCONFIG_CONFIG="test/configs/linux.config")
    for args in ([sys.executable, "scripts/kconfig.py", "header", out],
                 ["make", "-s", "-f", "src/build.mk", "OUT=" + out,
                  "PYTHON=" + sys.executable,
                  "BOARD=../test/firmware/fakeboard", *variables]):
        result = subprocess.run(args, cwd=ROOT, env=env, capture_output=True,
                                text=True)
        assert result.returncode == 0, result.stdout + result.stderr
    return ROOT / out / "klipper.elf"


@pytest.fixture(scope="module")
def program():
    return build(OUT)


@pytest.fixture(scope="module")
def interleaved():
    """Interrupts may strike between any two memory accesses of it."""
    return build(INTERLEAVE_OUT, "FAKE_SANITIZER=interleave")


def run(program, *args):
    result = subprocess.run([program, *args], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.mark.parametrize("seed", range(1, 6))
def test_timers_run_in_order(program, seed):
    assert "ran in order" in run(program, "sched", str(seed))


def test_interrupts_anywhere_change_nothing(program):
    assert "points" in run(program, "injection")


def count_points(output):
    return int(output.split()[-2])


def test_interrupts_between_memory_accesses_change_nothing(interleaved):
    """Each 19th point; test-slow takes them all."""
    assert count_points(run(interleaved, "injection", "1", "19")) > 20000


def test_a_trigger_within_a_command_is_before_or_after_it(interleaved):
    assert count_points(run(interleaved, "races")) > 100


@pytest.mark.slow
@pytest.mark.parametrize("first", range(1, 5))
def test_interrupts_between_any_memory_accesses(interleaved, first):
    run(interleaved, "injection", str(first), "4")


@pytest.mark.parametrize("seed", range(1, 6))
def test_any_bytes_are_survived(program, seed):
    assert "4000 inputs" in run(program, "fuzz", str(seed))
