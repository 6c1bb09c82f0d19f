# SPDX-License-Identifier: GPL-3.0-or-later
"""A started program is not told that it uses the memory of the tests before it."""

import subprocess
import sys

from own_memory import own_memory

PEAK = "import resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
HOG = ("import subprocess, sys; full = b'1' * 300_000_000; "
       "sys.exit(subprocess.run(sys.argv[1:]).returncode)")


def peak_after_hog(command):
    """Peak memory in KiB that a program sees, started by one that has 300 MB."""
    result = subprocess.run([sys.executable, "-c", HOG, *command],
                            capture_output=True, text=True, check=True)
    return int(result.stdout)


def test_only_own_memory_counts():
    command = [sys.executable, "-c", PEAK]
    assert peak_after_hog(command) > 280_000, "then the shell is not needed any more"
    assert peak_after_hog(own_memory(command)) < 100_000


def test_the_exit_code_is_the_programs():
    command = own_memory([sys.executable, "-c", "import sys; sys.exit(7)"])
    assert subprocess.run(command, check=False).returncode == 7
