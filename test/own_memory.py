# SPDX-License-Identifier: GPL-3.0-or-later
"""Start programs that are judged by the memory they use themselves.

Linux counts the peak memory of whoever starts a program to that program
(getrusage's ru_maxrss outlives execve).  After other tests that may be more than
a fuzzer's limit before it has done anything.
"""


def own_memory(command):
    """The command line under a shell, whose child starts counting at its own size.

    The shell has something left to do afterwards, so it does not replace itself.
    """
    return ["sh", "-c", '"$@"; exit $?', "sh", *command]
