# SPDX-License-Identifier: GPL-3.0-or-later
"""One seed, one world: every byte on every link at the same moment."""

import os
import pathlib
import subprocess
import sys

import pytest

SCRIPT = pathlib.Path(__file__).resolve().parent / "link_digest.py"


def run_job(seed, **environment):
    """[(mcu, bytes, digest)] of a run in a process of its own."""
    result = subprocess.run([sys.executable, str(SCRIPT), str(seed)], check=True,
                            capture_output=True, text=True,
                            env=dict(os.environ, **environment))
    return [tuple(line.split()) for line in result.stdout.splitlines()]


@pytest.fixture(scope="module")
def first():
    return run_job(7, PYTHONHASHSEED="1")


def test_same_seed_gives_the_same_bytes(first):
    assert [name for name, _, _ in first] == ["mcu", "tool"]
    assert all(int(size) > 5000 for _, size, _ in first)
    assert run_job(7, PYTHONHASHSEED="2") == first


def test_uncompiled_host_sends_the_same_bytes(first):
    assert run_job(7, KLIPPY_PURE="1") == first


def test_other_seed_gives_another_world(first):
    other = run_job(8)
    assert [name for name, _, _ in other] == ["mcu", "tool"]
    assert all(a[2] != b[2] for a, b in zip(first, other, strict=True))
