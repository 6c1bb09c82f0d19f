# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulator's tests again, on a firmware built with sanitizers."""

import os
import subprocess
import sys

import pytest
from simboard import ROOT, build_simulator

FLAGS = "-fno-lto -fsanitize=address,undefined -fno-sanitize-recover=all"


@pytest.mark.slow
def test_simulator_under_sanitizers():
    library = build_simulator("out/test-sanitized/", FLAGS)
    runtime = subprocess.run(["gcc", "-print-file-name=libasan.so"], text=True,
                             capture_output=True, check=True).stdout.strip()
    env = dict(os.environ, SIMULATOR_SO=str(library), LD_PRELOAD=runtime,
               ASAN_OPTIONS="detect_leaks=0")
    tests = [str(ROOT / "test/firmware" / ("test_fw_%s.py" % name))
             for name in ("command", "motion", "io", "buttons", "counter",
                          "neopixel", "tmcuart", "spi", "i2c", "display",
                          "thermocouple", "accel", "angle", "loadcell",
                          "trigger_analog")]
    result = subprocess.run([sys.executable, "-m", "pytest", "-q", *tests,
                             "-p", "no:cacheprovider"], cwd=ROOT, env=env,
                            capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
