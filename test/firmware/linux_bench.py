# SPDX-License-Identifier: GPL-3.0-or-later
"""How many commands the linux firmware carries out in a second of a processor.

Its own time counts (of the process, the system's part of it included), not how
long a busy computer lets it wait.
"""

import os
import tempfile
import time

from linux_board import LinuxBoard, build_linux
from simboard import frame

NOPS = 48               # in a block
N_BLOCKS = 8            # at once, within the window that it takes
TRIES = 100
REPEATS = 5             # the least disturbed counts
CPUCLOCK_SCHED = 2      # kind of a process's clock, as Linux numbers them


def read_cpu_time(pid):
    """Seconds of processor time that a process has had."""
    return time.clock_gettime(~pid << 3 | CPUCLOCK_SCHED)


def send_nops(host):
    """Blocks full of debug_nop in one go, until all are acknowledged; returns how
    many commands."""
    nop = host.commands["debug_nop"].encode({})
    payload = nop * (NOPS // len(nop))
    data = b"".join(frame(host.seq + i, payload) for i in range(N_BLOCKS))
    host.seq = (host.seq + N_BLOCKS) & 15
    os.write(host.fd, data)
    host.wait(lambda: host.acked == host.seq)
    return N_BLOCKS * (NOPS // len(nop))


def measure_once(board):
    pid = board.run.process.pid
    before = read_cpu_time(pid)
    done = sum(send_nops(board.host) for _ in range(TRIES))
    return (read_cpu_time(pid) - before) / done


def measure_nop():
    """Seconds of a processor that a debug_nop takes, with its share of all else."""
    with tempfile.TemporaryDirectory() as folder:
        board = LinuxBoard(build_linux(), folder)
        try:
            return min(measure_once(board) for _ in range(REPEATS))
        finally:
            board.close()
