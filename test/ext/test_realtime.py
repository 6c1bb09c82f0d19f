# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory that stays, as far as the system permits."""

import subprocess
import sys

SCRIPT = """
import resource, sys
from klippy_ext.realtime import lock_memory
if sys.argv[1] == "limited":
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (1 << 20, 1 << 20))
try:
    lock_memory()
    print("locked")
except PermissionError:
    print("refused")
big = bytearray(50 << 20)
print(next(line for line in open("/proc/self/status") if "VmLck" in line).split()[1])
print(int(next(line for line in open("/proc/self/status")
               if "CapEff" in line).split()[1], 16) >> 14 & 1)
print(int(resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] < 0))
"""


def run(way):
    text = subprocess.run([sys.executable, "-c", SCRIPT, way], check=True,
                          capture_output=True, text=True).stdout
    result, locked, is_capable, is_unlimited = text.split()
    return result, int(locked), int(is_capable), int(is_unlimited)


def test_memory_is_locked_if_nothing_can_go_wrong():
    result, locked, is_capable, is_unlimited = run("plain")
    assert result == ("locked" if is_capable or is_unlimited else "refused")
    assert (locked > 0) == (result == "locked")


def test_a_limit_is_respected():
    """Behind it the process could not get any memory any more."""
    result, locked, is_capable, _ = run("limited")
    assert result == ("locked" if is_capable else "refused")
    assert (locked > 0) == bool(is_capable)
