# SPDX-License-Identifier: GPL-3.0-or-later
"""C tests of the firmware's core on the fake board, under sanitizers."""

import os
import subprocess
import sys

import pytest
from simboard import ROOT

OUT = "out/test-fakeboard/"


@pytest.fixture(scope="module")
def program():
    """The fake board's program, brought up to date."""
    env = dict(os.environ, KCONFIG_CONFIG="test/configs/linux.config")
    for args in ([sys.executable, "scripts/kconfig.py", "header", OUT],
                 ["make", "-s", "-f", "src/build.mk", "OUT=" + OUT,
                  "PYTHON=" + sys.executable,
                  "BOARD=../test/firmware/fakeboard"]):
        result = subprocess.run(args, cwd=ROOT, env=env, capture_output=True,
                                text=True)
        assert result.returncode == 0, result.stdout + result.stderr
    return ROOT / OUT / "klipper.elf"


def run(program, *args):
    result = subprocess.run([program, *args], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.mark.parametrize("seed", range(1, 6))
def test_timers_run_in_order(program, seed):
    assert "ran in order" in run(program, "sched", str(seed))


def test_interrupts_anywhere_change_nothing(program):
    assert "points" in run(program, "injection")


@pytest.mark.parametrize("seed", range(1, 6))
def test_any_bytes_are_survived(program, seed):
    assert "4000 inputs" in run(program, "fuzz", str(seed))
