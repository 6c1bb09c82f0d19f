# SPDX-License-Identifier: GPL-3.0-or-later
"""The link's Python side, where what comes is out of the ordinary."""
from klippy.serialhdl import SerialReader


class Queue:
    """Gives its entries; an exception is raised."""

    def __init__(self, *entries):
        self.entries = list(entries)

    def pull(self):
        entry = self.entries.pop(0) if self.entries else None
        if isinstance(entry, Exception):
            raise entry
        return entry


def list_faults(reactor, *entries):
    reader, faults = SerialReader(reactor, "mcu"), []
    reader.set_fault_callback(faults.append)
    reader._run_thread(Queue(*entries))
    return faults


def test_lost_messages_are_a_fault(reactor):
    """The queue has no memory for a message, and says so by an empty one."""
    assert list_faults(reactor, (b"", 0., 1., 0)) == [
        "Out of memory: messages of an mcu were lost"]


def test_thread_without_memory_goes_on(reactor):
    assert list_faults(reactor, MemoryError(), (b"", 0., 1., 0)) == [
        "Internal error on response of an mcu: MemoryError",
        "Out of memory: messages of an mcu were lost"]
