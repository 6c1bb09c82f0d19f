# SPDX-License-Identifier: GPL-3.0-or-later
"""State on disk that survives a power cut at any write.

Two files are written in turns, each with number, length and check sum: while one
is being written the other holds the state before.
"""

import json
import logging
import os
import threading
import zlib

MAGIC = "klippy-recovery-1"
MAX_SIZE = 1024 * 1024          # bytes of a state that are read


class Journal:
    """The states of one thing, the last of which can be read again."""

    def __init__(self, path):
        """path: of the two files, which get .0 and .1 behind it."""
        self.paths = ["%s.%d" % (path, slot) for slot in range(2)]
        self.sequence = 0

    def write(self, state):
        """Write a state (plain types) to the disk.  Any thread.  Raises OSError."""
        text = json.dumps(state).encode()
        self.sequence += 1
        head = "%s %d %d %08x\n" % (MAGIC, self.sequence, len(text),
                                    _calc_check(self.sequence, text))
        data = head.encode() + text
        fd = os.open(self.paths[self.sequence % 2],
                     os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            position = 0
            while position < len(data):
                position += os.pwrite(fd, data[position:], position)
            os.ftruncate(fd, len(data))
            os.fdatasync(fd)
        finally:
            os.close(fd)

    def read(self):
        """The last state that was written, None if there is none."""
        found = [entry for entry in map(_read_slot, self.paths) if entry]
        if not found:
            return None
        self.sequence, state = max(found, key=lambda entry: entry[0])
        return state


def _calc_check(sequence, text):
    """Check sum of a slot: a new number on an old text must not pass."""
    return zlib.crc32(text, zlib.crc32(b"%d" % (sequence,)))


def _read_slot(path):
    """(sequence, state) of a file, None if it is not whole."""
    try:
        with open(path, "rb") as file:
            data = file.read(MAX_SIZE)
        head, _, text = data.partition(b"\n")
        magic, sequence, length, check = head.decode("ascii").split(" ")
        text = text[:int(length)]
        if (magic != MAGIC or len(text) != int(length)
                or _calc_check(int(sequence), text) != int(check, 16)):
            return None
        return int(sequence), json.loads(text)
    except (OSError, ValueError):
        return None


class JournalThread:
    """Writes states in a thread of its own: a slow disk holds up nobody.

    States that come faster than the disk takes them replace each other.
    """

    def __init__(self, journal):
        self.journal = journal
        self.condition = threading.Condition()
        self.next_state, self.must_end = None, False
        self.has_failed = False
        self.thread = threading.Thread(target=self._run, name="recovery",
                                       daemon=True)
        self.thread.start()

    def write(self, state):
        """Have a state written soon."""
        with self.condition:
            self.next_state = state
            self.condition.notify()

    def close(self):
        """Write what is left and end the thread."""
        with self.condition:
            self.must_end = True
            self.condition.notify()
        self.thread.join()

    def _run(self):
        while True:
            with self.condition:
                while self.next_state is None and not self.must_end:
                    self.condition.wait()
                state, self.next_state = self.next_state, None
            if state is None:
                return
            self.has_failed = not try_write(self.journal, state, self.has_failed)


def try_write(journal, state, has_failed):
    """Write a state; a failure is logged unless the last one failed too.

    Returns whether it is written.
    """
    try:
        journal.write(state)
        return True
    except OSError as err:
        if not has_failed:
            logging.error("The state of the print is not saved: %s", err)
        return False
