# SPDX-License-Identifier: GPL-3.0-or-later
"""What the system grants to a host that must not wait."""

from klippy_ext.c_realtime cimport realtime_get_counts, realtime_lock_memory


def lock_memory():
    """Keep the process's memory from being swapped out.

    Raises OSError (PermissionError) if that is not permitted.
    """
    ret = realtime_lock_memory()
    if ret:
        raise OSError(-ret, "memory cannot be locked")


def get_thread_counts():
    """(threads with real-time priority, those that were refused it) so far."""
    cdef int raised = 0, refused = 0
    realtime_get_counts(&raised, &refused)
    return raised, refused
