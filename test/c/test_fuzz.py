# SPDX-License-Identifier: GPL-3.0-or-later
"""All parsers of what comes from outside, fed with what nobody would send.

FUZZ_SECONDS (default 60) is the time for all targets together.
"""

import os
import pathlib
import shutil
import subprocess
import sys

import pytest
from own_memory import own_memory

ROOT = pathlib.Path(__file__).resolve().parents[2]
CSRC = ROOT / "klippy_ext" / "csrc"
SECONDS = max(1, int(os.environ.get("FUZZ_SECONDS", "60")) // 4)
C_TARGETS = {
    "fuzz_msgblock.c": ["msgblock", "qmsg", "rto", "cmdqueue", "sqcore",
                        "sqreceive"],
    "fuzz_gscan.c": ["gscan"],
}


def run_fuzzer(command, folder, max_len):
    """Run a libFuzzer for its share of the time; it must find nothing."""
    result = subprocess.run(
        own_memory([*command, "-max_total_time=%d" % (SECONDS,),
                    "-max_len=%d" % (max_len,), "-seed=1"]),
        cwd=folder, capture_output=True, text=True, check=False,
        env=dict(os.environ, PYTHONPATH=str(ROOT), KLIPPY_PURE="1"))
    report = result.stderr[-4000:]
    assert result.returncode == 0, report
    assert "Done" in result.stderr, report


@pytest.mark.skipif(not shutil.which("clang"), reason="libFuzzer needs clang")
@pytest.mark.parametrize("source", C_TARGETS)
def test_fuzz_c(source, tmp_path):
    program = tmp_path / "fuzz"
    subprocess.run(
        ["clang", "-std=gnu11", "-O1", "-g",
         "-fsanitize=fuzzer,address,undefined", "-I", str(CSRC), "-o", str(program),
         str(ROOT / "test" / "c" / source),
         *[str(CSRC / (name + ".c")) for name in C_TARGETS[source]],
         "-lm", "-lpthread"], check=True)
    run_fuzzer([str(program)], tmp_path, 512)


@pytest.mark.parametrize("target", ["fuzz_config.py", "fuzz_gcode.py"])
def test_fuzz_python(target, tmp_path):
    pytest.importorskip("atheris", reason="atheris has no build for this Python")
    run_fuzzer([sys.executable, str(ROOT / "test" / "c" / target)], tmp_path, 2048)
